#include <gmock/gmock.h>

#include "server/fleet/fleet_values.hpp"
#include "server/session/session_registry.hpp"
#include "tests/unit/server/fake_directory.hpp"
#include "tests/unit/server/session_fixture.hpp"

namespace hairnet::server {
namespace {

using ::testing::ElementsAre;
using ::testing::Eq;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Optional;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAreArray;

auto sent_to(const std::string& host, std::uint16_t port) {
  return Field(&wire::Redirect::to, Optional(wire::ServerAt{host, port}));
}

// Sessions of the server hair-1 in a fleet, whose directory does what the test says. A claim or a release of a room is
// undecided until decide() or put_elsewhere().
class SessionInFleet : public SessionTest {
 protected:
  SessionInFleet() {
    context_.fleet = &fleet_;
    context_.room_grace_ns = 2 * kSecond_ns;
  }
  struct Client {
    std::shared_ptr<FakeConnection> connection = std::make_shared<FakeConnection>();
    PacketSink* sink = nullptr;
  };
  // Opens a connection and sends the Hello. Whether the client gets a Welcome depends on the directory.
  Client join(wire::Hello hello = {}) {
    Client client;
    client.sink = registry_.open(client.connection, now_ns_);
    client.sink->on_packet(wire::encode_packet({now_ns_, std::move(hello)}), now_ns_);
    return client;
  }
  void pass(std::int64_t ns) {
    now_ns_ += ns;
    registry_.poll(now_ns_);
  }
  static std::size_t welcomes(const Client& client) { return client.connection->all<wire::Welcome>().size(); }
  static std::vector<wire::Redirect> redirects(const Client& client) {
    return client.connection->all<wire::Redirect>();
  }
  static wire::Goodbye goodbye(const Client& client) {
    const auto all = client.connection->all<wire::Goodbye>();
    return all.empty() ? wire::Goodbye{} : all.back();
  }
  Session& session_of(const Client& client) { return *static_cast<Session*>(client.sink); }

  FakeDirectory fleet_;
  SessionRegistry registry_{context_};
};

TEST_F(SessionInFleet, who_asks_for_a_room_of_another_server_is_sent_there) {
  fleet_.put_elsewhere("hall", kOtherId, {"hair-2", 7421, ""});
  const Client client = join({.client_name = "", .room = "hall"});
  EXPECT_THAT(redirects(client), ElementsAre(sent_to("hair-2", 7421)));
  EXPECT_EQ(goodbye(client).reason, wire::GoodbyeReason::server_full);
  EXPECT_EQ(welcomes(client), 0u);
  EXPECT_TRUE(client.connection->closed);
  EXPECT_EQ(context_.session_count, 0u);
  EXPECT_EQ(counters_.sessions_redirected.value(), 1u);
}

TEST_F(SessionInFleet, a_client_that_knows_no_redirect_reads_the_address_in_its_goodbye) {
  fleet_.put_elsewhere("hall", kOtherId, {"hair-2", 7421, ""});
  // A client says in its Hello which messages it knows; Redirect has a higher number than 28.
  const Client client = join({.client_name = "", .room = "hall", .message_max = 28});
  EXPECT_THAT(redirects(client), IsEmpty());
  EXPECT_THAT(goodbye(client).detail, HasSubstr("hair-2, port 7421"));
}

TEST_F(SessionInFleet, a_room_that_nobody_holds_is_claimed_before_anyone_is_welcome) {
  const Client client = join({.client_name = "", .room = "hall"});
  EXPECT_THAT(fleet_.claimed, ElementsAre("hall"));
  pass(kSecond_ns / 50);
  EXPECT_EQ(welcomes(client), 0u);
  fleet_.decide("hall", Placement::Kind::here);
  pass(kSecond_ns / 50);
  EXPECT_EQ(welcomes(client), 1u);
  EXPECT_EQ(context_.session_count, 1u);
}

TEST_F(SessionInFleet, a_claim_that_another_server_won_sends_the_client_to_it) {
  const Client client = join({.client_name = "", .room = "hall"});
  fleet_.put_elsewhere("hall", kOtherId, {"hair-2", 7421, ""});
  pass(kSecond_ns / 50);
  EXPECT_THAT(redirects(client), ElementsAre(sent_to("hair-2", 7421)));
}

TEST_F(SessionInFleet, placement_sends_a_new_room_to_a_server_with_free_time) {
  fleet_.all[0].load.free_share = 0;
  fleet_.all.push_back(server_at(kOtherId, "hair-2", 7421));
  // This server has no free time, and hair-2 has all of its own.
  const Client client = join({.client_name = "", .room = "hall"});
  EXPECT_THAT(redirects(client), ElementsAre(sent_to("hair-2", 7421)));
  EXPECT_THAT(fleet_.claimed, IsEmpty());
}

TEST_F(SessionInFleet, one_who_was_sent_here_is_not_sent_back) {
  fleet_.all[0].load.free_share = 0;
  fleet_.all.push_back(server_at(kOtherId, "hair-2", 7421));
  // The Hello says how many servers have sent the client on. Two servers that think each other free would otherwise
  // send it to and fro.
  const Client client = join({.client_name = "", .room = "hall", .redirects = 1});
  EXPECT_THAT(redirects(client), IsEmpty());
  EXPECT_THAT(fleet_.claimed, ElementsAre("hall"));
}

TEST_F(SessionInFleet, a_client_that_servers_send_on_and_on_is_counted) {
  // A client follows four redirects in a row (kRedirectsMax in entry.cpp); with the fifth, servers send it in a circle.
  fleet_.put_elsewhere("hall", kOtherId, {"hair-2", 7421, ""});
  join({.client_name = "", .room = "hall", .redirects = 3});
  EXPECT_EQ(counters_.redirect_loops.value(), 0u);
  const Client client = join({.client_name = "", .room = "hall", .redirects = 4});
  EXPECT_THAT(redirects(client), ElementsAre(sent_to("hair-2", 7421)));
  EXPECT_EQ(counters_.redirect_loops.value(), 1u);
}

TEST_F(SessionInFleet, a_directory_that_does_not_answer_refuses_with_its_reason) {
  fleet_.places["hall"] = {.kind = Placement::Kind::unavailable, .reason = "etcd does not answer"};
  const Client client = join({.client_name = "", .room = "hall"});
  EXPECT_EQ(goodbye(client).reason, wire::GoodbyeReason::server_full);
  EXPECT_EQ(goodbye(client).detail, "etcd does not answer");
  EXPECT_EQ(counters_.sessions_refused_fleet.value(), 1u);
}

TEST_F(SessionInFleet, a_claim_without_an_outcome_ends_the_wait) {
  const Client client = join({.client_name = "", .room = "hall"});
  pass(context_.limits.handshake_timeout_ns + 1);
  EXPECT_EQ(goodbye(client).reason, wire::GoodbyeReason::server_full);
  EXPECT_EQ(counters_.sessions_refused_fleet.value(), 1u);
  EXPECT_EQ(counters_.sessions_closed_by_server_handshake_timeout.value(), 0u);
}

TEST_F(SessionInFleet, a_second_hello_does_not_pass_by_the_first_that_waits) {
  // The client waits for the claim of the hall. Its second Hello names a room that is here, and must not replace the
  // first one.
  const Client client = join({.client_name = "", .room = "hall"});
  fleet_.decide("other", Placement::Kind::here);
  client.sink->on_packet(wire::encode_packet({now_ns_, wire::Hello{.client_name = "", .room = "other"}}), now_ns_);
  EXPECT_EQ(welcomes(client), 0u);
  EXPECT_EQ(counters_.messages_refused_unexpected.value(), 1u);
}

TEST_F(SessionInFleet, a_client_that_goes_before_its_welcome_leaves_no_claim_behind) {
  // Clients who make up names of rooms and leave must not fill the directory.
  for (int i = 0; i < 50; ++i) {
    const Client client = join({.client_name = "", .room = "made-up-" + std::to_string(i)});
    client.sink->on_closed("gone", now_ns_);
  }
  for (const std::string& room : fleet_.claimed) fleet_.decide(room, Placement::Kind::here);
  // Empty rooms are looked for once in a second; 4 s pass.
  for (int i = 0; i < 20; ++i) pass(kSecond_ns / 5);
  EXPECT_THAT(fleet_.released, UnorderedElementsAreArray(fleet_.claimed))
      << "before the grace of a room that somebody was in";
}

TEST_F(SessionInFleet, waiting_is_not_counted_as_asking_again) {
  // The client asks for session 77, which does not exist, so it gets a new one once its room is claimed.
  const Client client = join({.client_name = "", .room = "hall", .session = 77});
  for (int i = 0; i < 10; ++i) pass(kSecond_ns / 50);
  EXPECT_EQ(counters_.sessions_not_resumed.value(), 1u);
  EXPECT_THAT(fleet_.claimed, ElementsAre("hall"));
}

TEST_F(SessionInFleet, nobody_is_sent_to_an_owner_that_drains) {
  fleet_.all.push_back(server_at(kOtherId, "hair-2", 7421));
  fleet_.all.back().draining = true;
  fleet_.put_elsewhere("hall", kOtherId, {"hair-2", 7421, ""});
  const Client client = join({.client_name = "", .room = "hall"});
  EXPECT_THAT(redirects(client), IsEmpty());
  // The draining server has given the room up, so this server claims it.
  fleet_.decide("hall", Placement::Kind::unowned);
  pass(kSecond_ns / 50);
  EXPECT_THAT(fleet_.claimed, ElementsAre("hall"));
  fleet_.decide("hall", Placement::Kind::here);
  pass(kSecond_ns / 50);
  EXPECT_EQ(welcomes(client), 1u);
}

TEST_F(SessionInFleet, a_restarted_server_sends_nobody_to_itself) {
  // The directory still names the server's former life, with another ID at the same address, hair-1:7420.
  fleet_.put_elsewhere("hall", 99, {"hair-1", 7420, ""});
  const Client client = join({.client_name = "", .room = "hall", .redirects = 1});
  pass(kSecond_ns / 50);
  EXPECT_THAT(redirects(client), IsEmpty());
  EXPECT_THAT(client.connection->all<wire::Goodbye>(), IsEmpty());
}

// A client is in the room hall of this server, and another server, hair-2, could take it.
class SessionInOwnRoom : public SessionInFleet {
 protected:
  SessionInOwnRoom() {
    fleet_.decide("hall", Placement::Kind::here);
    client_ = join({.client_name = "", .room = "hall"});
    fleet_.all.push_back(server_at(kOtherId, "hair-2", 7421));
  }
  void push_frame() {
    session_of(client_).outbox().push_frames({{wire::encode_packet({now_ns_, wire::FrameBatch{1, 0, {}}}), 1, false}});
    registry_.flush(now_ns_);
  }
  std::size_t frames() { return client_.connection->all<wire::FrameBatch>().size(); }

  Client client_;
};

TEST_F(SessionInOwnRoom, frames_stop_while_the_lease_is_not_safe_and_go_on_after_it) {
  // A server whose lease may have ended must send no frames, since another server may have the room by now.
  push_frame();
  EXPECT_EQ(frames(), 1u);
  fleet_.is_open = false;
  push_frame();
  EXPECT_EQ(frames(), 1u);
  fleet_.is_open = true;
  push_frame();
  EXPECT_EQ(frames(), 2u) << "and those that were withheld are not sent late";
}

TEST_F(SessionInOwnRoom, a_room_that_overloads_the_server_takes_no_late_joiners_but_those_that_come_back) {
  // The hall alone takes more than the server has. Who is in it stays and may resume, but nobody else comes, and no
  // character is added.
  context_.overloaded_room = "hall";
  const Client late = join({.client_name = "", .room = "hall"});
  EXPECT_EQ(goodbye(late).reason, wire::GoodbyeReason::room_refused);
  EXPECT_EQ(goodbye(late).detail, kRoomOverloaded);
  EXPECT_EQ(counters_.sessions_refused_overloaded.value(), 1u);
  wire::AddCharacter add;
  add.character = 1;
  add.groom = groom_service_.known;
  client_.sink->on_packet(wire::encode_packet({now_ns_, add}), now_ns_);
  EXPECT_EQ(context_.character_count, 0u);
  EXPECT_EQ(client_.connection->all<wire::Error>().back().reason, wire::ErrorReason::limit_exceeded);
  const wire::Welcome welcome = client_.connection->all<wire::Welcome>()[0];
  session_of(client_).on_closed("broken", now_ns_);
  const Client again = join({.client_name = "", .session = welcome.session, .secret = welcome.secret});
  EXPECT_EQ(welcomes(again), 1u);
  context_.overloaded_room.clear();
  join({.client_name = "", .room = "hall"});
  EXPECT_EQ(counters_.sessions_refused_overloaded.value(), 1u);
}

// A room that another server had. Its moderator has banned mallory, muted loud, and locked the room while alice, loud
// and mallory were in it. The ban of "old" has expired.
class SessionInMovedRoom : public SessionInFleet {
 protected:
  SessionInMovedRoom() {
    context_.limits.session_count_max = 10;
    context_.limits.messages_burst = 1000;
    context_.token_key.emplace(std::vector<std::uint8_t>(64, 7));
    context_.unix_time_s = [this] { return unix_s_; };
    RoomKept kept{.bans = {{"sub:mallory", unix_s_ + 100}, {"sub:old", unix_s_ - 1}},
                  .mutes = {"sub:loud"},
                  .is_locked = true,
                  .members = {"sub:alice", "sub:loud", "sub:mallory"},
                  .wind = wire::encode_packet({0, wire::SetWind{{.mean_m_per_s = {1, 2, 3}}}})};
    std::size_t left_out = 0;
    fleet_.decide("hall", Placement::Kind::here);
    registry_.on_room_claimed("hall", to_value(kept, left_out), now_ns_);
  }
  Client enter(const std::string& subject, bool moderate = false) {
    channel::TokenClaims claims;
    claims.expires_s = unix_s_ + 1'000'000;
    claims.subject = subject;
    claims.moderate = moderate;
    return join({.client_name = "", .room = "hall", .token = channel::sign(claims, key_)});
  }
  RoomKept kept() {
    pass(kSecond_ns);
    const auto read = parse_kept(fleet_.kept["hall"]);
    EXPECT_TRUE(read);
    return read ? *read : RoomKept{};
  }

  channel::TokenKey key_{std::vector<std::uint8_t>(64, 7)};
  std::int64_t unix_s_ = 1'800'000'000;
};

TEST_F(SessionInMovedRoom, bans_and_the_lock_hold_but_for_those_who_were_in_it) {
  EXPECT_EQ(goodbye(enter("mallory")).reason, wire::GoodbyeReason::removed);
  EXPECT_EQ(goodbye(enter("stranger")).reason, wire::GoodbyeReason::room_refused);
  EXPECT_EQ(counters_.sessions_refused_locked.value(), 1u);
  EXPECT_EQ(welcomes(enter("alice")), 1u);
  EXPECT_TRUE(context_.rules.is_muted("hall", "sub:loud"));
  EXPECT_FALSE(context_.rules.is_banned("hall", "sub:old", now_ns_));
  // People of a moved room have 60 s to come back (RoomKeeper::kReturn_ns).
  pass(61 * kSecond_ns);
  EXPECT_EQ(goodbye(enter("loud")).reason, wire::GoodbyeReason::room_refused) << "it has had a minute to come back";
  EXPECT_EQ(welcomes(enter("boss", true)), 1u);
}

TEST_F(SessionInMovedRoom, the_wind_goes_on_for_the_first_who_comes) {
  enter("alice");
  const std::vector<OpenSession> opened = commands<OpenSession>();
  ASSERT_EQ(opened.size(), 1u);
  ASSERT_TRUE(opened[0].wind);
  EXPECT_EQ(opened[0].wind->mean_m_per_s, Vec3(1, 2, 3));
}

TEST_F(SessionInMovedRoom, what_changes_is_kept_for_the_next_server) {
  const Client boss = enter("boss", true);
  enter("alice");
  boss.sink->on_packet(
      wire::encode_packet({now_ns_, wire::Moderate{wire::ModerateAction::remove, 0, "sub:eve", 50, ""}}), now_ns_);
  boss.sink->on_packet(
      wire::encode_packet({now_ns_, wire::Moderate{wire::ModerateAction::unmute, 0, "sub:loud", 0, ""}}), now_ns_);
  boss.sink->on_packet(wire::encode_packet({now_ns_, wire::SetWind{{.mean_m_per_s = {4, 0, 0}}}}), now_ns_);
  const RoomKept now = kept();
  // A second has passed in kept(): mallory's ban of 100 s has 99 left, and eve's ban of 50 s has 49.
  EXPECT_THAT(now.bans,
              ElementsAre(RoomKept::Ban{"sub:mallory", unix_s_ + 99}, RoomKept::Ban{"sub:eve", unix_s_ + 49}));
  EXPECT_THAT(now.mutes, IsEmpty());
  EXPECT_TRUE(now.is_locked);
  EXPECT_THAT(now.members, ElementsAre("sub:alice", "sub:boss"));
  const auto wind = wire::decode_packet(now.wind);
  EXPECT_EQ(std::get<wire::SetWind>(wind.envelope.message).wind.mean_m_per_s, Vec3(4, 0, 0));
}

TEST_F(SessionInMovedRoom, a_wind_is_kept_for_the_next_server_until_who_has_set_it_leaves) {
  enter("alice");
  const Client boss = enter("boss", true);
  boss.sink->on_packet(wire::encode_packet({now_ns_, wire::SetWind{{.mean_m_per_s = {4, 0, 0}}}}), now_ns_);
  EXPECT_FALSE(kept().wind.empty());
  boss.sink->on_packet(wire::encode_packet({now_ns_, wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}}), now_ns_);
  EXPECT_THAT(kept().wind, IsEmpty());
}

TEST_F(SessionInMovedRoom, a_wind_moves_with_the_room_of_a_server_that_drains) {
  const Client boss = enter("boss", true);
  boss.sink->on_packet(wire::encode_packet({now_ns_, wire::SetWind{{.mean_m_per_s = {4, 0, 0}}}}), now_ns_);
  registry_.drain(kSecond_ns, now_ns_);
  pass(2 * kSecond_ns);
  EXPECT_FALSE(parse_kept(fleet_.kept["hall"]).value().wind.empty());
  for (const CloseSession& closed : commands<CloseSession>()) EXPECT_TRUE(closed.goes_on_elsewhere);
}

TEST_F(SessionInMovedRoom, as_many_props_as_a_room_may_have_go_on_for_the_first_who_comes_to_the_next_server) {
  const Client boss = enter("boss", true);
  wire::SetProps set;
  // The room has kPropsMax props (128), and then number 5 is removed.
  for (unsigned i = 0; i < wire::kPropsMax; ++i)
    set.props.push_back({static_cast<std::uint8_t>(i), sphere(0.25), {Quat::Identity(), {0.1 * i, -1.7, 0.3}}});
  boss.sink->on_packet(wire::encode_packet({now_ns_, set}), now_ns_);
  boss.sink->on_packet(wire::encode_packet({now_ns_, wire::SetProps{{}, {5}}}), now_ns_);
  kept();
  EXPECT_EQ(counters_.kept_left_out.value(), 0u);
  // The room moves to another server and back, with what the directory keeps of it.
  const std::string text = fleet_.kept["hall"];
  fleet_.put_elsewhere("hall", kOtherId, {"hair-2", 7421, ""});
  registry_.on_room_lost("hall", now_ns_);
  EXPECT_EQ(context_.props.count("hall"), 0u);
  pass(kSecond_ns);
  commands<OpenSession>();
  fleet_.decide("hall", Placement::Kind::here);
  registry_.on_room_claimed("hall", text, now_ns_);
  enter("boss", true);
  enter("other", true);
  const std::vector<OpenSession> opened = commands<OpenSession>();
  ASSERT_EQ(opened.size(), 2u);
  ASSERT_EQ(opened[0].props.size(), wire::kPropsMax - 1);
  EXPECT_EQ(opened[0].props[4].number, 4);
  EXPECT_EQ(opened[0].props[5].number, 6);
  EXPECT_EQ(opened[0].props[5].shape, sphere(0.25));
  EXPECT_EQ(opened[0].props[5].place.position.cast<float>(), Vec3f(0.6f, -1.7f, 0.3f));
  EXPECT_TRUE(opened[1].props.empty()) << "the tick has them";
}

TEST_F(SessionInMovedRoom, props_of_a_room_that_all_have_left_are_kept_no_longer) {
  const Client boss = enter("boss", true);
  boss.sink->on_packet(wire::encode_packet({now_ns_, wire::SetProps{{{1, sphere(0.25), {}}}}}), now_ns_);
  EXPECT_FALSE(kept().props.empty());
  boss.sink->on_packet(wire::encode_packet({now_ns_, wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}}), now_ns_);
  EXPECT_FALSE(kept().props.empty()) << "the empty room exists for a while";
  // The room's grace of 2 s ends; 8 s pass.
  for (int i = 0; i < 40; ++i) pass(kSecond_ns / 5);
  EXPECT_THAT(fleet_.released, ElementsAre("hall"));
  EXPECT_THAT(parse_kept(fleet_.kept["hall"]).value().props, IsEmpty());
  EXPECT_EQ(context_.props.count("hall"), 0u);
}

TEST_F(SessionInMovedRoom, a_draining_server_keeps_what_has_just_changed) {
  const Client boss = enter("boss", true);
  boss.sink->on_packet(wire::encode_packet({now_ns_, wire::Moderate{wire::ModerateAction::unlock, 0, "", 0, ""}}),
                       now_ns_);
  registry_.drain(kSecond_ns, now_ns_);
  pass(kSecond_ns / 2);
  EXPECT_FALSE(parse_kept(fleet_.kept["hall"]).value().is_locked);
  EXPECT_THAT(fleet_.released, ElementsAre("hall"));
}

TEST_F(SessionInMovedRoom, a_lock_ends_when_those_who_were_in_the_room_do_not_come_back_and_bans_stay) {
  // The server waits `kReturn_ns` (60 s, room_keeper.hpp) for the people of a moved room; 58 s are just less.
  for (int i = 0; i < 58; ++i) pass(kSecond_ns);
  EXPECT_THAT(fleet_.released, IsEmpty());
  EXPECT_EQ(goodbye(enter("stranger")).reason, wire::GoodbyeReason::room_refused);
  for (int i = 0; i < 6; ++i) pass(kSecond_ns);
  EXPECT_THAT(fleet_.released, ElementsAre("hall"));
  const RoomKept left = parse_kept(fleet_.kept["hall"]).value();
  EXPECT_FALSE(left.is_locked);
  EXPECT_THAT(left.bans, SizeIs(1));
  EXPECT_EQ(context_.rules.entry_count(), 0u) << "another server may have it now";
}

TEST_F(SessionInMovedRoom, a_room_that_all_have_left_keeps_its_bans_only) {
  const Client boss = enter("boss", true);
  boss.sink->on_packet(wire::encode_packet({now_ns_, wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}}), now_ns_);
  // The room's grace of 2 s ends; 8 s pass.
  for (int i = 0; i < 40; ++i) pass(kSecond_ns / 5);
  EXPECT_THAT(fleet_.released, ElementsAre("hall"));
  const RoomKept left = parse_kept(fleet_.kept["hall"]).value();
  EXPECT_THAT(left.bans, SizeIs(1));
  EXPECT_FALSE(left.is_locked);
  EXPECT_THAT(left.wind, IsEmpty());
}

TEST_F(SessionInMovedRoom, a_draining_server_unlocks_a_room_that_all_have_just_left) {
  const Client boss = enter("boss", true);
  boss.sink->on_packet(wire::encode_packet({now_ns_, wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}}), now_ns_);
  registry_.drain(kSecond_ns, now_ns_);
  pass(kSecond_ns / 2);
  EXPECT_FALSE(parse_kept(fleet_.kept["hall"]).value().is_locked);
}

TEST_F(SessionInMovedRoom, a_new_claim_replaces_what_this_server_remembers) {
  registry_.on_room_claimed("hall", "", now_ns_);
  EXPECT_EQ(welcomes(enter("mallory")), 1u);
  EXPECT_EQ(context_.rules.entry_count(), 0u);
}

TEST_F(SessionInMovedRoom, a_text_that_is_not_valid_is_refused_and_counted) {
  registry_.on_room_claimed("hall", "{\"locked\":1}", now_ns_);
  EXPECT_EQ(counters_.rooms_kept_refused.value(), 1u);
  EXPECT_EQ(welcomes(enter("stranger")), 1u);
  std::size_t left_out = 0;
  registry_.on_room_claimed("hall", to_value({.is_locked = true, .wind = {1, 2, 3}}, left_out), now_ns_);
  EXPECT_EQ(counters_.rooms_kept_refused.value(), 2u);
  EXPECT_TRUE(context_.rules.is_locked("hall")) << "its wind alone is not valid";
  // A prop's size may be 100 m at most (kTouchSizeMax_m).
  const std::vector<std::uint8_t> too_large = wire::encode_packet({0, wire::SetProps{{{1, sphere(101), {}}}}});
  registry_.on_room_claimed("hall", to_value({.is_locked = true, .props = too_large}, left_out), now_ns_);
  EXPECT_EQ(counters_.rooms_kept_refused.value(), 3u);
  EXPECT_TRUE(context_.rules.is_locked("hall")) << "its props alone are not valid";
  EXPECT_EQ(context_.props.count("hall"), 0u);
}

TEST_F(SessionInMovedRoom, more_than_the_server_may_have_is_left_out_and_counted) {
  context_.limits.bans_max = 3;
  RoomKept kept{.mutes = {"a", "b"}, .is_locked = true};
  for (int i = 0; i < 5; ++i) kept.bans.push_back({"sub:" + std::to_string(i), unix_s_ + 10});
  std::size_t left_out = 0;
  registry_.on_room_claimed("hall", to_value(kept, left_out), now_ns_);
  // Five bans, two mutes and the lock are eight entries, and bans_max bounds all of them.
  EXPECT_EQ(context_.rules.entry_count(), 3u);
  EXPECT_EQ(counters_.kept_left_out.value(), 5u);
}

TEST_F(SessionInOwnRoom, a_lost_room_takes_its_sessions_along) {
  fleet_.put_elsewhere("hall", kOtherId, {"hair-2", 7421, ""});
  registry_.on_room_lost("hall", now_ns_);
  EXPECT_THAT(redirects(client_), ElementsAre(sent_to("hair-2", 7421)));
  EXPECT_EQ(context_.session_count, 0u);
}

TEST_F(SessionInOwnRoom, a_room_that_is_handed_over_takes_its_sessions_and_its_rules_along) {
  ASSERT_TRUE(context_.rules.lock("hall", 10));
  context_.rooms_changed.insert("hall");
  registry_.hand_over("hall", kOtherId, now_ns_);
  EXPECT_EQ(fleet_.handed_over["hall"], kOtherId);
  EXPECT_TRUE(parse_kept(fleet_.kept["hall"]).value().is_locked) << "before the release";
  const Client late = join({.client_name = "", .room = "hall"});
  pass(kSecond_ns / 50);
  EXPECT_THAT(redirects(client_), IsEmpty()) << "the room is still being released";
  EXPECT_THAT(redirects(late), IsEmpty());
  fleet_.put_elsewhere("hall", kOtherId, {"hair-2", 7421, ""});
  registry_.on_room_lost("hall", now_ns_);
  pass(kSecond_ns / 50);
  EXPECT_THAT(redirects(client_), ElementsAre(sent_to("hair-2", 7421)));
  EXPECT_THAT(redirects(late), ElementsAre(sent_to("hair-2", 7421)));
  EXPECT_EQ(context_.session_count, 0u);
  EXPECT_THAT(fleet_.claimed, IsEmpty()) << "nobody claims it back";
}

TEST_F(SessionInOwnRoom, where_nobody_is_known_to_have_a_lost_room_clients_ask_where_they_asked_first) {
  fleet_.places["hall"] = {.kind = Placement::Kind::unavailable, .reason = "etcd does not answer"};
  registry_.on_room_lost("hall", now_ns_);
  EXPECT_THAT(redirects(client_), ElementsAre(Field(&wire::Redirect::to, Eq(std::nullopt))));
}

TEST_F(SessionInOwnRoom, a_detached_session_ends_with_its_room) {
  session_of(client_).on_closed("broken", now_ns_);
  registry_.on_room_lost("hall", now_ns_);
  EXPECT_EQ(context_.session_count, 0u);
}

TEST_F(SessionInOwnRoom, a_draining_server_gives_its_rooms_up_and_then_sends_their_sessions_on) {
  registry_.drain(kSecond_ns, now_ns_);
  // Rooms are given up half a second after the drain begins (kNotice_ns in session_registry.cpp).
  pass(kSecond_ns / 2);
  EXPECT_THAT(fleet_.released, ElementsAre("hall"));
  pass(kSecond_ns / 50);
  EXPECT_THAT(redirects(client_), IsEmpty()) << "the room is still being released";
  fleet_.decide("hall", Placement::Kind::unowned);
  pass(kSecond_ns / 50);
  EXPECT_THAT(redirects(client_), ElementsAre(sent_to("hair-2", 7421)));
}

TEST_F(SessionInOwnRoom, a_draining_server_leaves_others_time_to_prepare_the_grooms_of_its_rooms) {
  // Other servers hear which grooms they need. They have half a second (kNotice_ns in session_registry.cpp) before the
  // room is given up.
  groom_service_.used = {wire::GroomHash{7}, wire::GroomHash{8}};
  registry_.drain(2 * kSecond_ns, now_ns_);
  EXPECT_EQ(fleet_.passed_on, groom_service_.used);
  EXPECT_TRUE(fleet_.is_draining);
  pass(kSecond_ns / 4);
  EXPECT_THAT(fleet_.released, IsEmpty()) << "the room goes on";
  pass(kSecond_ns / 4);
  EXPECT_THAT(fleet_.released, ElementsAre("hall"));
}

TEST_F(SessionInOwnRoom, a_draining_server_gives_up_a_room_that_it_wins_late) {
  fleet_.decide("hall", Placement::Kind::unowned);  // whatever becomes of the first client
  const Client late = join({.client_name = "", .room = "late", .redirects = 1});
  EXPECT_THAT(fleet_.claimed, ElementsAre("late"));
  registry_.drain(kSecond_ns, now_ns_);
  fleet_.decide("late", Placement::Kind::here);
  pass(kSecond_ns / 2);
  EXPECT_THAT(fleet_.released, ElementsAre("late"));
  fleet_.decide("late", Placement::Kind::unowned);
  pass(kSecond_ns / 50);
  EXPECT_THAT(redirects(late), ElementsAre(sent_to("hair-2", 7421)));
}

TEST_F(SessionInOwnRoom, a_detached_session_keeps_its_room_until_its_grace_ends) {
  session_of(client_).on_closed("broken", now_ns_);
  // A detached session lives for 10 s (resume_grace_ns), and its empty room for 2 s more. Nine seconds pass, and then
  // six.
  for (int i = 0; i < 90; ++i) pass(kSecond_ns / 10);
  EXPECT_EQ(context_.session_count, 1u);
  EXPECT_THAT(fleet_.released, IsEmpty());
  for (int i = 0; i < 60; ++i) pass(kSecond_ns / 10);
  EXPECT_EQ(context_.session_count, 0u);
  EXPECT_THAT(fleet_.released, ElementsAre("hall"));
}

TEST_F(SessionInOwnRoom, without_time_to_drain_sessions_get_their_goodbye_at_once) {
  registry_.drain(0, now_ns_);
  EXPECT_EQ(goodbye(client_).reason, wire::GoodbyeReason::server_draining);
}

TEST_F(SessionInOwnRoom, a_draining_server_says_goodbye_where_no_other_takes_the_room) {
  fleet_.all.pop_back();
  registry_.drain(kSecond_ns, now_ns_);
  fleet_.decide("hall", Placement::Kind::unowned);
  pass(kSecond_ns / 2);
  EXPECT_THAT(client_.connection->all<wire::Goodbye>(), IsEmpty());
  pass(kSecond_ns);
  EXPECT_EQ(goodbye(client_).reason, wire::GoodbyeReason::server_draining);
}

TEST_F(SessionInOwnRoom, a_room_that_all_have_left_is_given_up_after_its_grace) {
  client_.sink->on_packet(wire::encode_packet({now_ns_, wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}}),
                          now_ns_);
  // The grace is 2 s, so the room still exists after 2 s; after 3 s more it does not.
  for (int i = 0; i < 20; ++i) pass(kSecond_ns / 10);
  EXPECT_THAT(fleet_.released, IsEmpty());
  for (int i = 0; i < 30; ++i) pass(kSecond_ns / 10);
  EXPECT_THAT(fleet_.released, ElementsAre("hall"));
}

TEST_F(SessionInOwnRoom, a_resume_needs_no_directory) {
  const wire::Welcome welcome = client_.connection->all<wire::Welcome>()[0];
  session_of(client_).on_closed("broken", now_ns_);
  // A resumed session is already in its room, so nothing has to be claimed or looked up.
  fleet_.is_open = false;
  const Client again = join({.client_name = "", .session = welcome.session, .secret = welcome.secret});
  ASSERT_THAT(again.connection->all<wire::Welcome>(), SizeIs(1));
  EXPECT_TRUE(again.connection->all<wire::Welcome>()[0].resumed);
}

}  // namespace
}  // namespace hairnet::server
