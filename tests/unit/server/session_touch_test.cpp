#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "server/session/entry.hpp"
#include "server/session/message_price.hpp"
#include "tests/unit/server/subject_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using wire::ErrorReason;
using enum AllowedClients;

// Makes a sample of one hand that has this many balls, with a radius of 4 cm.
wire::HandsSample hands(std::uint32_t sequence, std::int64_t captured_ns, std::size_t shapes = 1) {
  Hand hand;
  hand.shapes.assign(shapes, HandShape{.radius_m = 0.04});
  return {sequence, captured_ns, {hand}};
}

wire::Prop ball(std::uint8_t number, double radius_m = 0.2) {
  return {number, sphere(radius_m), {}};
}

wire::Hello as_observer() {
  wire::Hello hello;
  hello.role = wire::Role::observer;
  return hello;
}

TEST_F(SessionTest, hands_reach_the_tick_on_the_servers_clock_alone_and_beside_poses) {
  // The client's clock is a minute behind the server's, so the session must add a minute to the capture times. The
  // first hands were captured 4 ms before they were sent.
  const std::int64_t offset_ns = -60 * kSecond_ns, theirs_ns = now_ns_ + offset_ns;
  session_.on_message({theirs_ns, wire::Hello{}}, now_ns_);
  session_.on_message({theirs_ns, wire::AddCharacter{1, groom_service_.known, LevelIndex::low}}, now_ns_);
  commands<OpenSession>();
  session_.on_message({theirs_ns, wire::PoseBatch{{}, {}, hands(5, theirs_ns - 4'000'000)}}, now_ns_);
  wire::PoseBatch both = one_pose(rigid_pose({}), theirs_ns);
  both.hands = hands(6, theirs_ns);
  session_.on_message({theirs_ns, both}, now_ns_);
  EXPECT_THAT(errors(), IsEmpty());
  std::vector<Command> taken;
  commands_.take_all(taken);
  ASSERT_EQ(taken.size(), 3u);
  const auto& alone = std::get<PutHands>(taken[0]);
  EXPECT_EQ(alone.session, 7u);
  EXPECT_EQ(alone.arrived_ns, now_ns_);
  EXPECT_EQ(alone.sample.sequence, 5u);
  EXPECT_EQ(alone.sample.capture_time_ns, now_ns_ - 4'000'000);
  EXPECT_THAT(alone.sample.hands, SizeIs(1));
  EXPECT_EQ(std::get<PutHands>(taken[1]).sample.capture_time_ns, now_ns_);
  EXPECT_EQ(std::get<PutPoses>(taken[2]).poses.size(), 1u);
  EXPECT_EQ(counters_.hands_received.value(), 2u);
}

TEST_F(SessionTest, an_observer_has_hands_which_may_come_as_a_datagram) {
  send(as_observer());
  session_.on_datagram(wire::encode_packet({now_ns_, wire::PoseBatch{{}, {}, hands(1, now_ns_)}}), now_ns_);
  EXPECT_THAT(errors(), IsEmpty());
  const auto puts = commands<PutHands>();
  ASSERT_EQ(puts.size(), 1u);
  EXPECT_EQ(puts[0].sample.capture_time_ns, now_ns_);
}

TEST_F(SessionTest, hands_of_another_time_are_refused_one_error_a_second_and_poses_beside_them_taken) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  for (int i = 0; i < 3; ++i) {
    wire::PoseBatch batch;
    now_ns_ += 10'000'000;
    const auto sequence = static_cast<std::uint32_t>(i + 1);
    batch.poses.push_back({1, sequence, now_ns_, false, rigid_pose({})});
    // A capture time may be at most a minute from the envelope's clock (PeerClock::kCaptureSpan_ns).
    batch.hands = hands(sequence, now_ns_ + 61 * kSecond_ns);
    send(batch);
  }
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::touch_invalid));
  EXPECT_EQ(counters_.hands_rejected_time.value(), 3u);
  std::vector<Command> taken;
  commands_.take_all(taken);
  for (const Command& command : taken) EXPECT_FALSE(std::holds_alternative<PutHands>(command));
  EXPECT_EQ(taken.size(), 5u) << "the session, its character and three poses";
  now_ns_ += kSecond_ns;
  send(wire::PoseBatch{{}, {}, hands(9, now_ns_ - 61 * kSecond_ns)});
  EXPECT_EQ(errors().size(), 2u);
}

TEST_F(SessionTest, a_sample_of_hands_counts_as_a_pose_against_their_rate) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  wire::PoseBatch batch;
  // One sample of hands and 99 poses use up the 100 poses that small_limits() allows at once.
  batch.poses.assign(99, {1, 1, now_ns_, false, rigid_pose({})});
  batch.hands = hands(1, now_ns_);
  send(batch);
  EXPECT_EQ(counters_.hands_dropped_over_rate.value(), 0u);
  EXPECT_THAT(commands<PutHands>(), SizeIs(1));
  send(wire::PoseBatch{{}, {}, hands(2, now_ns_)});
  EXPECT_EQ(counters_.hands_dropped_over_rate.value(), 1u);
  EXPECT_EQ(counters_.poses_dropped_over_rate.value(), 0u);
  EXPECT_THAT(commands<PutHands>(), IsEmpty());
  EXPECT_THAT(errors(), IsEmpty());
}

TEST_F(SessionTest, hands_weigh_by_their_shapes_and_are_dropped_while_the_tick_is_busy) {
  hello();
  commands<OpenSession>();
  send(wire::PoseBatch{{}, {}, hands(1, now_ns_, 32)});
  // The command weighs 1, and each of its 32 shapes as much; 32 is the most that a person may have (kHandShapesMax).
  EXPECT_EQ(commands_.weight(), 33u);
  // The tick is so late that its queue of commands is full.
  for (Command filler = DetachSession{}; commands_.try_put(filler);) filler = DetachSession{};
  send(wire::PoseBatch{{}, {}, hands(2, now_ns_)});
  EXPECT_EQ(counters_.hands_dropped_busy.value(), 1u);
  EXPECT_THAT(errors(), IsEmpty());
}

TEST_F(SessionTest, the_owner_says_who_may_touch_a_character) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  send(wire::SetTouch{1, TouchAudience::chosen, {8, 9}});
  send(wire::SetTouch{2, TouchAudience::everyone});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::character_unknown));
  EXPECT_EQ(connection_->all<wire::Error>()[0].character, 2u);
  EXPECT_EQ(counters_.requests_refused_touch.value(), 1u);
  const auto set = requests<wire::SetTouch>();
  ASSERT_EQ(set.size(), 1u);
  EXPECT_EQ(set[0].audience, TouchAudience::chosen);
  EXPECT_THAT(set[0].chosen, ElementsAre(8u, 9u));
}

TEST_F(SessionTest, holds_out_of_range_are_refused_and_others_go_to_the_tick) {
  hello();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  // The shapes of a person have the numbers 0 to 31 (kHandShapesMax is 32), and a hand takes hold of hair within 0.3 m
  // at most (kGrabRadiusMax_m).
  send(wire::TakeHold{3, 31, {0, 0.1f, 0}, 0.05f});
  send(wire::LetGo{3, 31, Release::pin});
  EXPECT_THAT(errors(), IsEmpty());
  send(wire::TakeHold{3, 32, {0, 0, 0}, 0.05f});
  send(wire::TakeHold{3, 1, {0, nan, 0}, 0.05f});
  send(wire::TakeHold{3, 1, {0, 0, 0}, 0.31f});
  send(wire::TakeHold{3, 1, {0, 0, 0}, nan});
  send(wire::LetGo{3, 32, Release::drop});
  EXPECT_THAT(errors(), testing::AllOf(SizeIs(5), testing::Each(ErrorReason::touch_invalid)));
  EXPECT_EQ(counters_.requests_refused_hold.value(), 5u);
  std::vector<Command> taken;
  commands_.take_all(taken);
  // The first command opens the session.
  ASSERT_EQ(taken.size(), 3u);
  EXPECT_EQ(std::get<wire::TakeHold>(std::get<FromClient>(taken[1]).message).radius_m, 0.05f);
  EXPECT_EQ(std::get<wire::LetGo>(std::get<FromClient>(taken[2]).message).release, Release::pin);
}

TEST_F(SessionTest, the_tick_decides_whose_hair_an_observer_takes_hold_of) {
  send(as_observer());
  EXPECT_FALSE(connection_->all<wire::Welcome>().at(0).may_touch);
  send(wire::TakeHold{3, 1, {0, 0, 0}, 0.05f});
  EXPECT_THAT(errors(), IsEmpty());
  std::vector<Command> taken;
  commands_.take_all(taken);
  // The third command is the hold itself, which the tick may refuse.
  ASSERT_EQ(taken.size(), 3u);
  EXPECT_TRUE(std::holds_alternative<OpenSession>(taken[0]));
  EXPECT_EQ(std::get<SetTouchRight>(taken[1]).session, 7u);
  EXPECT_FALSE(std::get<SetTouchRight>(taken[1]).may_touch_others);
}

TEST_F(SessionTest, props_of_one_who_may_not_set_them_are_refused) {
  hello();
  EXPECT_FALSE(connection_->all<wire::Welcome>().at(0).may_set_props);
  send(wire::SetProps{{ball(1)}});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::not_allowed));
  EXPECT_EQ(counters_.requests_refused_props.value(), 1u);
  EXPECT_THAT(requests<wire::SetProps>(), IsEmpty());
  EXPECT_EQ(context_.props.count("lobby"), 0u);
}

TEST_F(SessionTest, a_message_with_one_prop_out_of_range_is_refused_as_a_whole) {
  context_.limits.props_from_clients = participants;
  hello();
  EXPECT_TRUE(connection_->all<wire::Welcome>().at(0).may_set_props);
  // A size may be 100 m at most (kTouchSizeMax_m), and a coordinate 10 000 m (kPositionMax_m).
  send(wire::SetProps{{ball(1), ball(2, 101)}});
  wire::Prop far = ball(3);
  far.place.position = {0, 20'000, 0};
  send(wire::SetProps{{ball(1), far}});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::touch_invalid, ErrorReason::touch_invalid));
  EXPECT_THAT(connection_->all<wire::Error>()[1].detail, HasSubstr("place"));
  EXPECT_EQ(counters_.requests_refused_props.value(), 2u);
  EXPECT_THAT(requests<wire::SetProps>(), IsEmpty());
  EXPECT_EQ(context_.props.count("lobby"), 0u);
  send(wire::SetProps{{ball(1)}});
  EXPECT_THAT(requests<wire::SetProps>(), SizeIs(1));
}

TEST(PropsOfRoomsTest, keeps_those_of_as_many_rooms_as_there_may_be_and_forgets_the_longest_empty_one) {
  PropsOfRooms props;
  // The last argument is the number of rooms, which is 3.
  const auto set = [&](const std::string& room) { props.set(room, {{ball(1)}, {}}, 3); };
  for (const char* room : {"a", "b", "c"}) set(room);
  // The numbers are the times at which the grace of each room ends. Room b is opened again, so c has been empty
  // longest, and after it a.
  props.close_room("b", 10);
  props.close_room("c", 11);
  props.close_room("a", 12);
  props.open_room("b");
  set("b");
  EXPECT_EQ(props.count("c"), 1u) << "there are no more rooms than before";
  set("d");
  EXPECT_EQ(props.count("c"), 0u);
  set("e");
  EXPECT_EQ(props.count("a"), 0u);
  for (const char* room : {"b", "d", "e"}) EXPECT_EQ(props.count(room), 1u) << room;
}

TEST_F(SessionTest, props_that_the_tick_does_not_get_are_not_remembered) {
  context_.limits.props_from_clients = participants;
  hello();
  for (Command filler = DetachSession{}; commands_.try_put(filler);) filler = DetachSession{};
  send(wire::SetProps{{ball(1)}});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_EQ(context_.props.count("lobby"), 0u);
}

TEST_F(SessionTest, touch_that_takes_memory_is_refused_while_memory_is_full) {
  context_.limits.props_from_clients = participants;
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  context_.is_memory_full = [] { return true; };
  send(wire::SetTouch{1, TouchAudience::chosen, {8}});
  send(wire::TakeHold{3, 1, {0, 0, 0}, 0.05f});
  send(wire::SetProps{{ball(1)}});
  EXPECT_THAT(errors(), testing::AllOf(SizeIs(3), testing::Each(ErrorReason::limit_exceeded)));
  EXPECT_EQ(counters_.messages_refused_memory.value(), 3u);
  send(wire::SetTouch{1, TouchAudience::nobody});
  send(wire::LetGo{3, 1, Release::drop});
  send(wire::SetProps{{}, {1}});
  EXPECT_THAT(errors(), SizeIs(3)) << "these free memory";
}

TEST_F(SessionTest, touch_costs_what_it_makes_the_server_do) {
  CountsByName rooms;
  const auto touch = [&] { return price_of(wire::SetTouch{}, rooms, "hall"); };
  const auto props = [&](std::size_t count) {
    return price_of(wire::SetProps{std::vector<wire::Prop>(count)}, rooms, "hall");
  };
  const double touch_alone = touch(), none = props(0);
  EXPECT_EQ(price_of(wire::LetGo{}, rooms, "hall"), 1);
  EXPECT_EQ(price_of(wire::TakeHold{}, rooms, "hall"), 2);
  EXPECT_EQ(none, 1);
  // message_price.hpp has these prices: 32 props, or 64 sessions that hear of a change, cost as much as a plain
  // message.
  EXPECT_EQ(props(128), none + 4);
  for (int i = 0; i < 256; ++i) rooms.enter("hall");
  EXPECT_EQ(touch(), touch_alone + 4);
  EXPECT_EQ(props(0), none + 4);
}

TEST_F(SessionTest, a_client_that_grabs_without_end_is_sent_away) {
  hello();
  // A hold has a price of 2, and small_limits() allows a price of 40 at once.
  for (int i = 0; i < 1000 && session_.state() == Session::State::active; ++i)
    send(wire::TakeHold{3, 1, {0, 0, 0}, 0.05f});
  EXPECT_THAT(goodbyes(), ElementsAre(wire::GoodbyeReason::over_rate));
}

// Several sessions, each with a token of its own, one of them a moderator's.
class TouchRightsTest : public SubjectTest {
 protected:
  TouchRightsTest() { context_.limits.messages_per_s = 1000; }
  static channel::TokenClaims moderator_claims() {
    channel::TokenClaims granted = claims("mod");
    granted.moderate = true;
    return granted;
  }
  // Returns the rights that the tick has got since the last call: the session, and whether it may touch others.
  std::vector<std::pair<std::uint64_t, bool>> announced() {
    std::vector<std::pair<std::uint64_t, bool>> all;
    for (const SetTouchRight& right : commands<SetTouchRight>())
      all.emplace_back(right.session, right.may_touch_others);
    return all;
  }
  bool may_set_props(Client& client) {
    const std::size_t before = client.errors().size();
    send(client, wire::SetProps{{ball(1)}});
    return client.errors().size() == before;
  }
  static std::uint64_t session_of(const Client& client) { return client.welcome().session; }
};

TEST_F(TouchRightsTest, the_token_says_who_may_touch_others_else_the_role) {
  const auto may = [this](wire::Role role, std::optional<bool> touch) {
    channel::TokenClaims granted = claims("");
    granted.role = role;
    granted.touch = touch;
    const Client client = join(granted);
    const bool is_announced = !announced().empty();
    EXPECT_EQ(client.welcome().may_touch, !is_announced) << "a right to touch needs no command";
    return client.welcome().may_touch;
  };
  using enum wire::Role;
  EXPECT_TRUE(may(participant, {}));
  EXPECT_FALSE(may(observer, {}));
  EXPECT_FALSE(may(participant, false));
  EXPECT_TRUE(may(observer, true));
}

TEST_F(TouchRightsTest, the_token_says_who_may_set_props_else_the_setting) {
  channel::TokenClaims watching = claims("watching"), kept_off = moderator_claims(), granted = claims("granted");
  watching.role = wire::Role::observer;
  kept_off.props = false;
  granted.props = true;
  const auto who_may = [&](AllowedClients setting) {
    context_.limits.props_from_clients = setting;
    std::vector<bool> all;
    for (const channel::TokenClaims& claims : {moderator_claims(), kept_off, granted, claims("plain"), watching}) {
      Client client = join(claims);
      all.push_back(may_set_props(client));
      EXPECT_EQ(client.welcome().may_set_props, all.back());
      leave(client);
    }
    return all;
  };
  EXPECT_THAT(who_may(off), ElementsAre(false, false, true, false, false));
  EXPECT_THAT(who_may(moderators), ElementsAre(true, false, true, false, false));
  EXPECT_THAT(who_may(participants), ElementsAre(true, false, true, true, false));
  EXPECT_THAT(who_may(everyone), ElementsAre(true, false, true, true, true));
}

TEST_F(TouchRightsTest, a_muted_subject_touches_no_others_and_sets_no_props_until_it_is_unmuted) {
  // Mallory has two sessions in the moderator's room and one in another room. A mute covers both sessions of the first
  // room, also after a resume and for later sessions, and leaves the other room alone.
  context_.limits.props_from_clients = participants;
  Client moderator = join(moderator_claims()), mallory = join(claims("mallory")), second = join(claims("mallory")),
         bob = join(claims("bob"));
  wire::Hello to_attic = hello_with(claims("mallory"));
  to_attic.room = "attic";
  Client elsewhere = connect(to_attic);
  EXPECT_THAT(announced(), IsEmpty());
  const std::uint64_t its = session_of(mallory);
  send(moderator, wire::Moderate{wire::ModerateAction::mute, its, ""});
  EXPECT_THAT(announced(), testing::UnorderedElementsAre(std::pair(its, false), std::pair(session_of(second), false)));
  send(moderator, wire::Moderate{wire::ModerateAction::mute, its, ""});
  EXPECT_THAT(announced(), IsEmpty()) << "the tick knows it";
  EXPECT_FALSE(may_set_props(mallory));
  EXPECT_THAT(mallory.errors(), ElementsAre(ErrorReason::not_allowed));
  EXPECT_TRUE(may_set_props(bob));
  EXPECT_TRUE(may_set_props(elsewhere));
  break_connection(mallory);
  mallory = resume(mallory, hello_with(claims("mallory")));
  EXPECT_FALSE(mallory.welcome().may_touch);
  EXPECT_FALSE(mallory.welcome().may_set_props);
  EXPECT_THAT(announced(), IsEmpty()) << "the right outlives a connection";
  leave(second);
  const Client third = join(claims("mallory"));
  EXPECT_FALSE(third.welcome().may_touch);
  EXPECT_THAT(announced(), ElementsAre(std::pair(session_of(third), false)));
  send(moderator, wire::Moderate{wire::ModerateAction::unmute, 0, "sub:mallory"});
  EXPECT_THAT(announced(), testing::UnorderedElementsAre(std::pair(its, true), std::pair(session_of(third), true)));
  EXPECT_TRUE(may_set_props(mallory));
}

TEST_F(TouchRightsTest, an_unmuted_session_whose_token_forbids_touch_still_may_not) {
  Client moderator = join(moderator_claims());
  channel::TokenClaims forbidden = claims("mallory");
  forbidden.touch = false;
  Client mallory = join(forbidden);
  EXPECT_THAT(announced(), SizeIs(1));
  for (const auto action : {wire::ModerateAction::mute, wire::ModerateAction::unmute})
    send(moderator, wire::Moderate{action, session_of(mallory), ""});
  EXPECT_THAT(moderator.errors(), IsEmpty());
  EXPECT_THAT(announced(), IsEmpty());
}

TEST_F(TouchRightsTest, the_newest_token_of_a_session_counts) {
  channel::TokenClaims forbidden = claims("alice");
  forbidden.touch = false;
  Client alice = join(claims("alice"));
  const std::uint64_t its = session_of(alice);
  EXPECT_THAT(announced(), IsEmpty());
  alice = resume(alice, hello_with(forbidden));
  EXPECT_FALSE(alice.welcome().may_touch);
  EXPECT_THAT(announced(), ElementsAre(std::pair(its, false)));
  // A session may resume once in a second (SessionLimits::resume_interval_ns).
  now_ns_ += 2 * kSecond_ns;
  alice = resume(alice, hello_with(claims("alice")));
  EXPECT_TRUE(alice.welcome().may_touch);
  EXPECT_THAT(announced(), ElementsAre(std::pair(its, true)));
}

TEST_F(TouchRightsTest, an_empty_room_keeps_its_props_for_the_next_who_comes_until_it_ends) {
  context_.limits.props_from_clients = everyone;
  context_.room_grace_ns = 10 * kSecond_ns;
  const auto numbers = [this] {
    std::vector<std::vector<int>> of_each;
    for (const OpenSession& open : commands<OpenSession>()) {
      of_each.emplace_back();
      for (const wire::Prop& prop : open.props) of_each.back().push_back(prop.number);
    }
    return of_each;
  };
  Client first = join_without_token("");
  send(first, wire::SetProps{{ball(4), ball(2), ball(9)}});
  send(first, wire::SetProps{{ball(2, 0.5)}, {2, 9}});
  EXPECT_EQ(entry_weight(context_, "lobby"), 3u) << "the command, and its props";
  leave(first);
  // The room's grace of 10 s is not over yet.
  now_ns_ += 9 * kSecond_ns;
  registry_.poll(now_ns_);
  Client second = join_without_token(""), third = join_without_token("");
  EXPECT_THAT(numbers(), ElementsAre(ElementsAre(), ElementsAre(2, 4), ElementsAre()))
      << "the tick has them once someone is in the room";
  now_ns_ += 30 * kSecond_ns;
  registry_.poll(now_ns_);
  EXPECT_EQ(context_.props.of_room("lobby").at(0).shape.radius_m, 0.5) << "someone is in it";
  leave(second);
  leave(third);
  // The room is empty for longer than its grace, so its props are gone.
  now_ns_ += 11 * kSecond_ns;
  registry_.poll(now_ns_);
  join_without_token("");
  EXPECT_THAT(numbers(), ElementsAre(ElementsAre()));
  EXPECT_EQ(entry_weight(context_, "lobby"), 1u);
}

}  // namespace
}  // namespace hairnet::server
