#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "tests/unit/client/settled_client.hpp"

namespace hairnet::link {
namespace {

TEST_F(Settled, a_broken_connection_is_replaced_after_the_reported_wait) {
  break_off();
  const std::optional<Reconnecting> lost = d.event<Reconnecting>();
  ASSERT_TRUE(lost);
  EXPECT_EQ(lost->detail, "the cable");
  // An outage that has just begun has the shortest bound of waits, Backoff::kBoundMin_ns.
  EXPECT_LE(lost->wait_s, 0.1);
  EXPECT_FALSE(d.core.wants_connection());
  const std::int64_t before = d.now_ns;
  d.pass_to_deadline();
  EXPECT_NEAR(1e-9 * static_cast<double>(d.now_ns - before), lost->wait_s, 1e-8);
  EXPECT_TRUE(d.core.wants_connection());
}

TEST(LinkCoreTrace, clients_that_lose_their_server_together_come_back_apart) {
  std::set<double> waits_s;
  for (std::uint64_t trace = 1; trace <= 20; ++trace) {
    LinkCoreOptions options;
    options.trace = trace;
    LinkCoreDriver d(options);
    d.connect();
    d.core.take_events();
    d.core.on_closed("the server stopped", d.now_ns);
    const std::optional<Reconnecting> lost = d.event<Reconnecting>();
    ASSERT_TRUE(lost);
    waits_s.insert(lost->wait_s);
  }
  EXPECT_EQ(waits_s.size(), 20u);
}

TEST_F(Settled, hello_names_the_session_and_its_secret) {
  break_off();
  come_back(welcome_to(5, true));
  EXPECT_EQ(hello.session, 5u);
  EXPECT_EQ(hello.secret, welcome_to(5).secret);
  const std::optional<Connected> connected = d.event<Connected>();
  ASSERT_TRUE(connected);
  EXPECT_TRUE(connected->again);
  EXPECT_TRUE(connected->welcome.resumed);
  EXPECT_EQ(d.core.counters().resumes, 1u);
}

TEST_F(Settled, a_connection_that_works_is_replaced_at_once_when_asked_and_the_session_goes_on) {
  ASSERT_TRUE(d.core.replace_connection("a better one", d.now_ns));
  const std::optional<Reconnecting> left = d.event<Reconnecting>();
  ASSERT_TRUE(left);
  EXPECT_EQ(left->detail, "a better one");
  EXPECT_EQ(left->wait_s, 0);
  EXPECT_TRUE(d.core.wants_close());
  d.close_as_wanted();
  ASSERT_TRUE(d.core.wants_connection());
  come_back(welcome_to(5, true));
  EXPECT_EQ(hello.session, 5u);
  EXPECT_EQ(hello.redirects, 0);
  d.expect<wire::SetLevel>();
  EXPECT_FALSE(d.take()) << "the server still has the rest";
  EXPECT_TRUE(d.core.active());
}

TEST_F(Settled, a_better_connection_that_breaks_is_replaced_after_a_wait) {
  ASSERT_TRUE(d.core.replace_connection("a better one", d.now_ns));
  d.close_as_wanted();
  d.core.on_opening(d.now_ns);
  EXPECT_FALSE(d.core.replace_connection("one more", d.now_ns)) << "it has no session at the moment";
  d.core.on_closed("the cable", d.now_ns);
  EXPECT_FALSE(d.core.wants_connection());
  come_back(welcome_to(5, true));
  EXPECT_TRUE(d.core.active());
}

TEST(LinkCoreWithoutReconnect, keeps_a_connection_that_works) {
  LinkCoreOptions options;
  options.reconnect = false;
  LinkCoreDriver d(options);
  d.connect();
  EXPECT_FALSE(d.core.replace_connection("a better one", d.now_ns));
  EXPECT_TRUE(d.core.active());
}

TEST_F(Settled, a_client_that_does_not_poll_ends_rather_than_goes_on_elsewhere) {
  // Each of these messages is too long, so the client itself answers it with an Error event that nobody takes. `fit` is
  // how many such events fit the queue beside the Connected of `other`; in `d`, one more takes its place.
  const auto cause_event = [](LinkCore& core) {
    core.send(wire::SetAppearance{7, std::string(wire::kTagBytesMax + 1, 'x'), {}});
  };
  LinkCoreDriver other;
  other.connect();
  int fit = -1;
  for (; !other.core.ended(); ++fit) cause_event(other.core);
  d.core.take_events();
  for (int n = 0; n < fit + 1; ++n) cause_event(d.core);
  ASSERT_TRUE(d.core.active());
  EXPECT_FALSE(d.core.replace_connection("a better one", d.now_ns));
  EXPECT_TRUE(d.core.ended());
  EXPECT_FALSE(d.core.wants_connection());
}

class SettledWithToken : public Settled {
 protected:
  SettledWithToken() : Settled(with_token()) {}
  static LinkCoreOptions with_token() {
    LinkCoreOptions options;
    options.token = "a.b.c";
    return options;
  }
};

TEST_F(SettledWithToken, a_resume_brings_the_token_again) {
  break_off();
  come_back(welcome_to(5, true));
  EXPECT_EQ(hello.session, 5u);
  EXPECT_EQ(hello.token, "a.b.c");
}

TEST_F(Settled, after_a_resume_only_possibly_missed_messages_are_sent_again) {
  d.core.offer_groom(hash_of(2), ten_bytes());
  d.core.send(wire::AddCharacter{8, hash_of(2), LevelIndex::high});
  d.core.send(wire::SetLevel{7, LevelIndex::ether});
  break_off();
  come_back(welcome_to(5, true));
  EXPECT_EQ(d.expect<wire::GroomOffer>().hash, hash_of(2));
  const auto level = d.expect<wire::SetLevel>();
  EXPECT_EQ(level.character, 7u);
  EXPECT_EQ(level.level, LevelIndex::ether);
  EXPECT_EQ(d.expect<wire::AddCharacter>().character, 8u);
  EXPECT_EQ(d.expect<wire::SetLevel>().character, 8u) << "it may have been added on another";
  EXPECT_FALSE(d.take());
  d.send(wire::Error{wire::ErrorReason::character_exists, 8, {}, ""});  // it had arrived before
  d.send(wire::CharacterAdded{7, hash_of(1), LevelIndex::low, 31});     // announced again
  EXPECT_TRUE(d.core.take_events().size() == 2u);                       // Reconnecting, Connected
  d.send(wire::Error{wire::ErrorReason::character_exists, 8, {}, ""});  // this one is the caller's
  EXPECT_TRUE(d.event<wire::Error>());
}

TEST_F(Settled, a_character_that_is_announced_before_it_is_refused_is_no_error) {
  d.core.send(wire::AddCharacter{8, hash_of(1), LevelIndex::high});
  break_off();
  come_back(welcome_to(5, true));
  d.core.take_events();
  // This answer belongs to the connection before.
  d.send(wire::CharacterAdded{8, hash_of(1), LevelIndex::high, 32});
  // This answer belongs to the new connection.
  d.send(wire::Error{wire::ErrorReason::character_exists, 8, {}, ""});
  EXPECT_TRUE(d.event<wire::CharacterAdded>());
  EXPECT_TRUE(d.core.take_events().empty());
}

TEST_F(Settled, a_groom_may_be_asked_for_again_until_it_is_ready) {
  d.core.offer_groom(hash_of(2), ten_bytes());
  d.expect<wire::GroomOffer>();
  d.send(wire::GroomNeed{hash_of(2), 10});  // another uploads it
  d.send(wire::GroomStatus{hash_of(2), wire::GroomState::queued});
  d.send(wire::GroomStatus{hash_of(2), wire::GroomState::building});
  EXPECT_FALSE(d.take());
  d.send(wire::GroomNeed{hash_of(2), 0});  // the other's bytes were wrong
  EXPECT_EQ(d.expect<wire::GroomChunk>().bytes.size(), 10u);
  d.send(wire::GroomStatus{hash_of(2), wire::GroomState::ready});
  d.send(wire::GroomNeed{hash_of(2), 0});
  EXPECT_FALSE(d.take());
}

TEST_F(Settled, an_unconfirmed_removal_is_sent_again_and_may_have_arrived) {
  d.core.send(wire::RemoveCharacter{7});
  break_off();
  come_back(welcome_to(5, true));
  EXPECT_EQ(d.expect<wire::RemoveCharacter>().character, 7u);
  EXPECT_FALSE(d.take());
  d.core.take_events();
  d.send(wire::Error{wire::ErrorReason::character_unknown, 7, {}, ""});
  const auto removed = d.event<wire::CharacterRemoved>();
  ASSERT_TRUE(removed) << "whose answer was lost with the connection";
  EXPECT_EQ(removed->character, 7u);
  EXPECT_TRUE(d.core.take_events().empty());
}

TEST_F(Settled, a_removal_is_told_also_when_its_member_has_left_unannounced_meanwhile) {
  d.core.send(wire::RemoveCharacter{7});
  break_off();
  come_back(welcome_to(5, true));
  // A member that is not announced within kMembersResendWait_ns, 1 s, after a resume has left (link_core.cpp).
  d.pass(2'000'000'000);
  d.core.take_events();
  d.send(wire::Error{wire::ErrorReason::character_unknown, 7, {}, ""});
  const auto removed = d.event<wire::CharacterRemoved>();
  ASSERT_TRUE(removed);
  EXPECT_EQ(removed->character, 7u);
}

TEST_F(Settled, a_member_that_left_and_came_back_meanwhile_is_not_there_twice) {
  d.send(wire::MemberJoined{40, 9, 3, hash_of(2)});
  d.core.take_events();
  break_off();
  come_back(welcome_to(5, true));
  d.core.take_events();
  d.send(wire::MemberJoined{41, 9, 3, hash_of(2)});
  const std::vector<Event> events = d.core.take_events();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(std::get<wire::MemberLeft>(events[0]).member, 40u);
  EXPECT_EQ(std::get<wire::MemberJoined>(events[1]).member, 41u);
}

TEST_F(Settled, a_new_server_gets_everything) {
  d.core.send(wire::SetMaterial{7, {}});
  d.core.send(wire::SetWind{{Vec3(9, 0, 0)}});
  d.core.send(wire::SetWind{{Vec3(3, 0, 0)}});
  wire::Observe observe;
  observe.mode = wire::ObserveMode::nearest;
  observe.count = 3;
  d.core.send(observe);
  break_off();
  come_back(welcome_to(6));
  EXPECT_EQ(d.expect<wire::GroomOffer>().hash, hash_of(1));
  const auto added = d.expect<wire::AddCharacter>();
  EXPECT_EQ(added.character, 7u);
  EXPECT_EQ(added.level, LevelIndex::low);
  EXPECT_EQ(d.expect<wire::SetMaterial>().character, 7u);
  EXPECT_EQ(d.expect<wire::Observe>().count, 3u);
  EXPECT_EQ(d.expect<wire::SetWind>().wind.mean_m_per_s.x(), 3);  // the newest alone
  d.send(wire::RoomWind{});                                       // the server's setting
  EXPECT_FALSE(d.take());
  d.send(wire::GroomNeed{hash_of(1), 0});
  EXPECT_EQ(d.expect<wire::GroomChunk>().bytes.size(), 10u);
  break_off();
  come_back(welcome_to(6, true));
  EXPECT_EQ(hello.session, 6u);
}

TEST_F(Settled, a_wind_is_sent_again_unless_another_client_has_set_one_since) {
  d.send(wire::RoomWind{});
  d.core.send(wire::SetWind{{Vec3(9, 0, 0)}});
  d.send(wire::RoomWind{{Vec3(9, 0, 0)}, 5});
  d.take_all();
  break_off();
  come_back(welcome_to(6));
  d.take_all();
  d.send(wire::RoomWind{});
  EXPECT_EQ(d.expect<wire::SetWind>().wind.mean_m_per_s.x(), 9);
  d.send(wire::RoomWind{{Vec3(0, 0, 5)}, 99});
  break_off();
  come_back(welcome_to(7));
  d.send(wire::RoomWind{});
  for (const wire::Message& message : d.take_all()) EXPECT_FALSE(std::holds_alternative<wire::SetWind>(message));
}

TEST_F(Settled, a_wind_goes_along_to_the_next_server) {
  d.send(wire::RoomWind{});
  d.core.send(wire::SetWind{{Vec3(9, 0, 0)}});
  d.send(wire::RoomWind{{Vec3(9, 0, 0)}, 5});
  d.take_all();
  d.send(wire::Redirect{wire::ServerAt{"hair-2", 7420}});
  d.close_as_wanted();
  come_back(welcome_to(6));
  d.send(wire::RoomWind{{Vec3(0, 0, 5)}, wire::RoomWind::kOfEarlierServer});  // kept before ours
  int count = 0;
  for (const wire::Message& message : d.take_all()) count += std::holds_alternative<wire::SetWind>(message) ? 1 : 0;
  EXPECT_EQ(count, 1);
}

TEST_F(Settled, a_moderation_is_sent_once) {
  d.core.send(wire::Moderate{wire::ModerateAction::remove, 9, "", 60, "be kind"});
  const auto sent = d.expect<wire::Moderate>();
  EXPECT_EQ(sent.session, 9u);
  EXPECT_EQ(sent.seconds, 60u);
  break_off();
  d.core.send(wire::Moderate{wire::ModerateAction::lock, 0, ""});
  come_back(welcome_to(6));
  d.expect<wire::GroomOffer>();
  d.expect<wire::AddCharacter>();
  EXPECT_FALSE(d.take());
}

TEST_F(Settled, a_refused_groom_is_not_offered_again) {
  d.send(wire::GroomStatus{hash_of(1), wire::GroomState::refused});
  break_off();
  come_back(welcome_to(6));
  d.expect<wire::AddCharacter>();
  EXPECT_FALSE(d.take());
}

TEST_F(Settled, a_draining_server_is_come_back_to) {
  d.send(wire::Goodbye{wire::GoodbyeReason::server_draining, "later"});
  EXPECT_EQ(d.event<Reconnecting>()->reason, wire::GoodbyeReason::server_draining);
  EXPECT_TRUE(d.core.wants_close());
  EXPECT_FALSE(d.core.wants_connection());
  d.pass(200 * kMs);
  EXPECT_FALSE(d.core.wants_connection());  // the old one is still there
  d.close_as_wanted();
  EXPECT_TRUE(d.core.wants_connection());
}

TEST_F(Settled, a_resume_that_comes_too_early_is_tried_again) {
  break_off();
  d.open();
  d.expect<wire::Hello>();
  d.core.take_events();
  d.send(wire::Goodbye{wire::GoodbyeReason::over_rate, "the session was resumed a moment ago"});
  EXPECT_EQ(d.event<Reconnecting>()->reason, wire::GoodbyeReason::over_rate);
  d.close_as_wanted();
  come_back(welcome_to(5, true));
  EXPECT_EQ(hello.session, 5u);
  EXPECT_EQ(d.core.counters().resumes, 1u);
}

TEST_F(Settled, refusals_that_would_be_repeated_end_it) {
  for (const wire::GoodbyeReason reason :
       {wire::GoodbyeReason::version_unsupported, wire::GoodbyeReason::token_refused,
        wire::GoodbyeReason::session_taken_over, wire::GoodbyeReason::protocol_error, wire::GoodbyeReason::removed}) {
    LinkCoreDriver c;
    c.connect();
    c.core.on_closed("the cable", c.now_ns);
    c.open();
    c.send(wire::Goodbye{reason, ""});
    EXPECT_TRUE(c.core.ended());
    EXPECT_EQ(c.event<Disconnected>()->reason, reason);
  }
}

TEST_F(Settled, waits_grow_while_nothing_works_and_are_short_again_after_a_good_while) {
  const auto longest_of = [&](int attempts) {
    double longest_s = 0;
    for (int i = 0; i < attempts; ++i) {
      for (int k = 0; k < 10 && !d.core.wants_connection(); ++k) d.pass_to_deadline();
      d.core.on_opening(d.now_ns);
      d.core.on_closed("refused", d.now_ns);
      longest_s = std::max(longest_s, d.event<Reconnecting>()->wait_s);
    }
    return longest_s;
  };
  break_off();
  // A wait is random, up to the length of the outage and at most 5 s (Backoff): the longest of 40 comes near 5 s.
  const double longest_s = longest_of(40);
  EXPECT_GT(longest_s, 4);
  EXPECT_LE(longest_s, 5);
  come_back(welcome_to(6));
  d.pass(100 * kMs);
  d.core.take_events();
  // Only a session of kStable_ns, 5 s (link_core.cpp), makes waits short again. This one has lasted 0.1 s.
  break_off();
  for (int i = 0; i < 5; ++i) (void)longest_of(1);
  EXPECT_GT(longest_of(30), 4);
  come_back(welcome_to(7));
  d.pass(6000 * kMs);
  d.core.take_events();
  break_off();
  EXPECT_LE(d.event<Reconnecting>()->wait_s, 0.1);
}

class Impatient : public Settled {
 protected:
  static LinkCoreOptions options() {
    LinkCoreOptions options;
    options.give_up_after_s = 30;
    return options;
  }
  Impatient() : Settled(options()) {}
};

TEST_F(Impatient, gives_up_after_the_time_asked_for) {
  break_off();
  const std::int64_t lost_ns = d.now_ns;
  while (!d.core.ended()) {
    d.pass_to_deadline();
    ASSERT_LE(d.now_ns - lost_ns, 30'000 * kMs);
    if (!d.core.wants_connection()) continue;
    d.core.on_opening(d.now_ns);
    d.core.on_closed("refused", d.now_ns);
  }
  EXPECT_EQ(d.now_ns - lost_ns, 30'000 * kMs);
  EXPECT_TRUE(d.event<Disconnected>());
}

TEST_F(Impatient, an_outage_that_ends_in_time_does_not_count_for_the_next) {
  for (int i = 0; i < 5; ++i) {
    break_off();
    come_back(welcome_to(5, true));
    d.pass(20'000 * kMs);
    ASSERT_TRUE(d.core.active());
  }
}

TEST(LinkCoreWithoutReconnect, a_broken_connection_is_the_end) {
  LinkCoreOptions options;
  options.reconnect = false;
  LinkCoreDriver d(options);
  d.connect();
  d.core.on_closed("the cable", d.now_ns);
  EXPECT_EQ(d.event<Disconnected>()->detail, "the cable");
}

TEST_F(Settled, a_teleport_that_was_lost_passes_to_the_next_pose_sent) {
  wire::PoseSample pose;
  pose.character = 7;
  pose.teleport = true;
  // The first pose is dropped when the connection breaks, the second for lack of a connection.
  d.core.push_poses({pose});
  break_off();
  pose.teleport = false;
  d.core.push_poses({pose});
  EXPECT_EQ(d.core.counters().poses_dropped, 2u);
  come_back(welcome_to(5, true));
  d.take_all();
  d.core.push_poses({pose});
  EXPECT_TRUE(d.expect<wire::PoseBatch>().poses[0].teleport);
  d.core.push_poses({pose});
  EXPECT_FALSE(d.expect<wire::PoseBatch>().poses[0].teleport);
}

TEST_F(Settled, another_server_gets_the_newest_pose_with_the_character) {
  d.core.send(wire::AddCharacter{9, hash_of(1)});
  const auto pose_at = [&](std::uint32_t sequence) {
    return wire::PoseSample{9, sequence, d.now_ns, false, rigid_pose({})};
  };
  d.core.push_poses({pose_at(1)});
  d.core.push_poses({pose_at(2)});
  break_off();
  come_back(welcome_to(6, false));
  const auto sent = d.take_all();
  const auto is_of_nine = [](const wire::Message& message) {
    const auto* added = std::get_if<wire::AddCharacter>(&message);
    return added && added->character == 9;
  };
  ASSERT_TRUE(std::ranges::any_of(sent, is_of_nine));
  ASSERT_TRUE(std::holds_alternative<wire::PoseBatch>(sent.back())) << "after its character";
  const auto& poses = std::get<wire::PoseBatch>(sent.back()).poses;
  ASSERT_EQ(poses.size(), 1u);
  EXPECT_EQ(poses[0].sequence, 2u);
  d.core.push_poses({pose_at(3)});
  const auto no_pose = [](const wire::Message& message) { return !std::holds_alternative<wire::PoseBatch>(message); };
  d.take_all();
  break_off();
  come_back(welcome_to(6, true));
  EXPECT_TRUE(std::ranges::all_of(d.take_all(), no_pose)) << "the same server has it";
  d.core.push_poses({pose_at(4)});
  // Only a pose that is at most kPoseAgeMax_ns, 500 ms, old goes to another server (link_core.cpp).
  d.pass(600 * kMs);
  break_off();
  come_back(welcome_to(7, false));
  EXPECT_TRUE(std::ranges::all_of(d.take_all(), no_pose)) << "it is too old";
}

TEST_F(Settled, another_servers_clock_estimate_starts_over) {
  break_off();
  d.open();
  d.expect<wire::Hello>();
  constexpr std::int64_t kOther_ns = 42;
  d.core.on_bytes(wire::encode_packet({kOther_ns, welcome_to(6)}), d.now_ns);
  EXPECT_EQ(d.core.to_local_ns(kOther_ns), d.now_ns);
}

TEST_F(Settled, members_announced_again_are_known_and_the_others_have_left) {
  for (const std::uint32_t member : {40u, 41u, 42u}) d.send(wire::MemberJoined{member, 9, member, hash_of(3)});
  EXPECT_EQ(d.events<wire::MemberJoined>().size(), 3u);
  break_off();
  come_back(welcome_to(5, true));
  d.core.take_events();
  d.send(wire::MemberJoined{40, 9, 40, hash_of(3)});
  // Another groom means another character.
  d.send(wire::MemberJoined{41, 9, 41, hash_of(4)});
  d.send(wire::MemberJoined{43, 9, 43, hash_of(3)});
  EXPECT_EQ(d.events<wire::MemberJoined>().size(), 2u);
  d.pass(1000 * kMs);
  const std::vector<wire::MemberLeft> left = d.events<wire::MemberLeft>();
  ASSERT_EQ(left.size(), 1u);
  EXPECT_EQ(left[0].member, 42u);
}

TEST_F(Settled, a_member_that_changed_during_the_outage_is_told_as_changed) {
  const wire::Appearance grey{{1, 1, 1}, {2, 2, 2}, {3, 3, 3}, 4};
  for (const std::uint32_t member : {40u, 41u}) d.send(wire::MemberJoined{member, 9, member, hash_of(3), "Ann", grey});
  d.send(wire::MemberChanged{40, "Anna", grey});
  d.send(wire::MemberChanged{40, "Anna", grey});  // the same
  d.send(wire::MemberChanged{99, "Eve", grey});   // nobody
  const auto changed = d.events<wire::MemberChanged>();
  ASSERT_EQ(changed.size(), 1u);
  EXPECT_EQ(changed[0].tag, "Anna");
  break_off();
  come_back(welcome_to(5, true));
  d.core.take_events();
  d.send(wire::MemberJoined{40, 9, 40, hash_of(3), "Anna", {}});
  d.send(wire::MemberJoined{41, 9, 41, hash_of(3), "Ann", grey});
  std::vector<wire::MemberChanged> meanwhile;
  for (const Event& event : d.core.take_events()) {
    EXPECT_FALSE(std::holds_alternative<wire::MemberJoined>(event));
    if (const auto* one = std::get_if<wire::MemberChanged>(&event)) meanwhile.push_back(*one);
  }
  ASSERT_EQ(meanwhile.size(), 1u);
  EXPECT_EQ(meanwhile[0].member, 40u);
  EXPECT_FALSE(meanwhile[0].appearance);
}

TEST_F(Settled, the_newest_tag_and_appearance_are_sent_again) {
  const wire::Appearance grey{{1, 1, 1}, {2, 2, 2}, {3, 3, 3}, 4};
  d.core.send(wire::SetAppearance{7, "Anna", grey});
  d.take_all();
  for (const bool resumed : {true, false}) {
    break_off();
    come_back(welcome_to(resumed ? 5 : 6, resumed));
    bool has_set = false, has_added = false;
    for (const wire::Message& message : d.take_all()) {
      if (const auto* set = std::get_if<wire::SetAppearance>(&message)) {
        has_set = true;
        EXPECT_EQ(set->tag, "Anna");
        EXPECT_EQ(set->appearance, grey);
      }
      if (const auto* added = std::get_if<wire::AddCharacter>(&message)) {
        has_added = true;
        EXPECT_EQ(added->tag, "Anna");
        EXPECT_EQ(added->appearance, grey);
      }
    }
    EXPECT_TRUE(has_set);
    EXPECT_EQ(has_added, !resumed);
  }
}

TEST_F(Settled, a_tag_that_is_too_long_is_refused_here_and_changes_nothing) {
  d.core.send(wire::SetAppearance{7, std::string(wire::kTagBytesMax + 1, 'x'), {}});
  d.core.send(wire::AddCharacter{8, hash_of(1), LevelIndex::low, {}, std::string(300, 'x'), {}});
  const auto errors = d.events<wire::Error>();
  ASSERT_EQ(errors.size(), 2u);
  EXPECT_EQ(errors[0].reason, wire::ErrorReason::limit_exceeded);
  EXPECT_EQ(errors[0].character, 7u);
  EXPECT_EQ(errors[1].detail, "tag: 300 bytes, more than " + std::to_string(wire::kTagBytesMax));
  EXPECT_TRUE(d.take_all().empty());
}

TEST_F(Settled, a_new_session_begins_without_members) {
  d.send(wire::MemberJoined{40, 9, 1, hash_of(3)});
  break_off();
  come_back(welcome_to(6));
  EXPECT_EQ(d.event<wire::MemberLeft>()->member, 40u);
}

TEST_F(Settled, a_broken_groom_download_continues_where_it_stopped) {
  d.core.request_groom(hash_of(8));
  d.take_all();
  d.send(wire::GroomData{hash_of(8), 100, 0, std::vector<std::uint8_t>(60)});
  break_off();
  come_back(welcome_to(5, true));
  d.expect<wire::SetLevel>();
  EXPECT_EQ(d.expect<wire::GroomRequest>().offset, 60u);
}

// Like a network simulator: the connection breaks after any byte, and the client reaches the same state.
TEST(LinkCoreUnderLoss, a_break_at_any_byte_is_survived) {
  const auto script = [](const LinkCoreDriver& d, bool resumed) {
    std::vector<std::uint8_t> stream;
    for (const wire::Message& message :
         {wire::Message(welcome_to(5, resumed)), wire::Message(wire::GroomNeed{hash_of(1), 0}),
          wire::Message(wire::CharacterAdded{7, hash_of(1), LevelIndex::rigid, 31}),
          wire::Message(wire::MemberJoined{40, 9, 1, hash_of(3)}),
          wire::Message(wire::GroomStatus{hash_of(1), wire::GroomState::ready})}) {
      const std::vector<std::uint8_t> packet = d.packet(message);
      stream.insert(stream.end(), packet.begin(), packet.end());
    }
    return stream;
  };
  const std::size_t length = script(LinkCoreDriver(), false).size();
  const std::size_t welcome_bytes = LinkCoreDriver().packet(welcome_to(5)).size();
  for (std::size_t cut = welcome_bytes; cut < length; ++cut) {
    for (const bool resumed : {false, true}) {
      LinkCoreDriver d;
      d.core.offer_groom(hash_of(1), ten_bytes());
      d.core.send(wire::AddCharacter{7, hash_of(1), LevelIndex::high});
      d.core.start();
      d.open();
      const std::vector<std::uint8_t> first = script(d, false);
      d.core.on_bytes({first.data(), cut}, d.now_ns);
      d.core.on_closed("the cable", d.now_ns);
      d.open();
      d.core.on_bytes(script(d, resumed), d.now_ns);
      ASSERT_TRUE(d.core.active());
      std::set<std::uint32_t> members;
      for (const Event& event : d.core.take_events()) {
        if (const auto* joined = std::get_if<wire::MemberJoined>(&event)) {
          EXPECT_TRUE(members.insert(joined->member).second);
        }
        if (const auto* left = std::get_if<wire::MemberLeft>(&event)) {
          EXPECT_EQ(members.erase(left->member), 1u);
        }
      }
      EXPECT_EQ(members, std::set<std::uint32_t>{40});
      EXPECT_EQ(d.core.counters().reconnects, 1u);
    }
  }
}

}  // namespace
}  // namespace hairnet::link
