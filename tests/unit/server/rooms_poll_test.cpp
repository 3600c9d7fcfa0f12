#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/unit/server/poll_fixture.hpp"

// The whole server without a socket: who sees whom.
namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class RoomsPollTest : public PollTest {
 protected:
  static std::set<std::uint32_t> members_seen(const FakeClient& client) {
    std::set<std::uint32_t> members;
    for (const auto& frame : client.all_frames()) members.insert(frame.member);
    return members;
  }
};

TEST_F(RoomsPollTest, all_sessions_in_a_room_see_the_same_hair_and_no_other) {
  start();
  const auto a = join("hall"), b = join("hall"), c = join("attic");
  run_ms(700, {a.get(), b.get(), c.get()});
  EXPECT_EQ(members_seen(*a).size(), 2u);
  EXPECT_EQ(members_seen(*b), members_seen(*a));
  EXPECT_EQ(members_seen(*c).size(), 1u);
  const auto own = a->frames(1);
  const auto others = b->member_frames(own.back().member);
  // There are 21 ticks in 700 ms; some pass before the levels are built and the members announced.
  ASSERT_GE(others.size(), 15u);
  std::size_t compared = 0;
  for (const auto& frame : own) {
    for (const auto& other : others) {
      if (other.tick != frame.tick) continue;
      EXPECT_EQ(other.displacements, frame.displacements);
      EXPECT_EQ(other.pose.head().position, frame.pose.head().position);
      ++compared;
    }
  }
  EXPECT_GE(compared, 15u);
  EXPECT_EQ(a->connection->all<wire::MemberJoined>().size(), 1u);
  EXPECT_THAT(c->connection->all<wire::MemberJoined>(), IsEmpty());
}

TEST_F(RoomsPollTest, a_late_joiner_gets_all_members_and_sees_sleepers_at_once) {
  start();
  const auto sleeper = join();
  sleeper->pose(1, rigid_pose({}), now_ns_);
  // A character falls asleep when its head and its hair have been still for 4.5 s (kSleepAfter_s); the hair moves a
  // little before.
  run_ms(9000);
  ASSERT_TRUE(sleeper->frames(1).back().asleep);
  const auto late = join();
  run_ms(200, {late.get()});
  ASSERT_EQ(late->connection->all<wire::MemberJoined>().size(), 1u);
  const auto seen = late->member_frames(late->connection->all<wire::MemberJoined>()[0].member);
  ASSERT_EQ(seen.size(), 1u) << "one, that it sleeps";
  EXPECT_TRUE(seen[0].asleep);
  EXPECT_EQ(seen[0].displacements, sleeper->frames(1).back().displacements);
}

TEST_F(RoomsPollTest, characters_of_one_address_belong_to_one_subject_in_whatever_rooms) {
  start();
  std::vector<std::unique_ptr<FakeClient>> clients;
  for (const char* address : {"192.0.2.1", "192.0.2.1", "192.0.2.2"}) {
    clients.push_back(std::make_unique<FakeClient>(*server_, now_ns_));
    FakeClient& client = *clients.back();
    client.connection->address = address;
    client.hello(now_ns_, "room" + std::to_string(clients.size()));
    client.upload(bytes_, hash_, now_ns_);
    client.send(wire::AddCharacter{1, hash_, LevelIndex::low}, now_ns_);
  }
  run_ms(100, {clients[0].get()});
  std::vector<std::uint32_t> subjects;
  for (const auto& [key, character] : server_->scheduler().rooms().characters()) subjects.push_back(character.subject);
  EXPECT_THAT(subjects, ElementsAre(1, 1, 2));
}

TEST_F(RoomsPollTest, an_observer_sees_without_being_seen) {
  start();
  const auto player = join("stage");
  FakeClient watcher(*server_, now_ns_);
  wire::Hello hello;
  hello.room = "stage";
  hello.role = wire::Role::observer;
  watcher.send(hello, now_ns_);
  run_ms(500, {player.get()});
  EXPECT_EQ(members_seen(watcher).size(), 1u);
  EXPECT_THAT(player->connection->all<wire::MemberJoined>(), IsEmpty());
}

TEST_F(RoomsPollTest, observers_choose_members_and_detail) {
  start();
  const auto a = join(), b = join();
  FakeClient watcher(*server_, now_ns_);
  watcher.hello(now_ns_);
  run_ms(300, {a.get(), b.get()});
  const auto joined = watcher.connection->all<wire::MemberJoined>();
  ASSERT_EQ(joined.size(), 2u);
  wire::Observe observe;
  observe.mode = wire::ObserveMode::list;
  observe.members = {joined[1].member};
  observe.stride = 2;
  observe.error_m = 0;
  watcher.send(observe, now_ns_);
  run_ms(100, {a.get(), b.get()});
  const std::size_t before = watcher.all_frames().size();
  run_ms(1000, {a.get(), b.get()});
  auto frames = watcher.all_frames();
  frames.erase(frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(before));
  // A stride of 2 leaves 15 of the 30 ticks of a second.
  EXPECT_NEAR(static_cast<double>(frames.size()), 15, 1);
  for (const auto& frame : frames) EXPECT_EQ(frame.member, joined[1].member);
  const auto theirs = b->frames(1);
  const auto same = std::ranges::find_if(theirs, [&](const auto& frame) { return frame.tick == frames.back().tick; });
  ASSERT_NE(same, theirs.end());
  // The owner's frames may err by 1 mm (the default of Observe::error_m), and the watcher has asked for the smallest
  // error, so both differ by little more.
  EXPECT_LT(frames.back().distance_m(*same), 1.1e-3f);
}

TEST_F(RoomsPollTest, an_unseen_character_is_not_stepped_and_continues_when_it_is_seen) {
  start();
  const auto client = join();
  run_ms(500, {client.get()});
  const std::uint32_t member = client->frames(1).back().member;
  client->send(wire::ReportImportance{{{member, 0, false}}}, now_ns_);
  // An unseen character is not stepped after a second (kSuspendAfter_s).
  run_ms(1300, {client.get()});
  const std::size_t before = client->all_frames().size();
  const std::uint64_t stepped = metrics_.tick.characters_stepped.value();
  run_ms(1000, {client.get()});
  EXPECT_EQ(client->all_frames().size(), before);
  EXPECT_EQ(metrics_.tick.characters_stepped.value(), stepped);
  client->send(wire::ReportImportance{{{member, 0.3f, true}}}, now_ns_);
  run_ms(300, {client.get()});
  auto frames = client->all_frames();
  ASSERT_GT(frames.size(), before + 5);
  EXPECT_TRUE(frames[before].discontinuous);
  EXPECT_FALSE(frames.back().discontinuous);
}

TEST_F(RoomsPollTest, an_observer_fetches_the_grooms_it_lacks) {
  start();
  const auto owner = join();
  FakeClient watcher(*server_, now_ns_);
  watcher.hello(now_ns_);
  run_ms(300, {owner.get()});
  const auto joined = watcher.connection->all<wire::MemberJoined>();
  ASSERT_EQ(joined.size(), 1u);
  watcher.send(wire::GroomRequest{joined[0].groom, 0}, now_ns_);
  run_ms(50, {owner.get()});
  std::vector<std::uint8_t> got;
  for (const auto& data : watcher.connection->all<wire::GroomData>())
    got.insert(got.end(), data.bytes.begin(), data.bytes.end());
  EXPECT_EQ(got, bytes_);
}

TEST_F(RoomsPollTest, a_groom_of_more_strands_than_the_client_may_have_takes_its_characters_along) {
  Config config;
  config.grooms.strands_per_session_max = small_groom().strand_count() - 1;
  start(config);
  const auto client = join();
  run_ms(300, {client.get()});
  EXPECT_THAT(client->errors(), testing::Contains(wire::ErrorReason::limit_exceeded));
  EXPECT_EQ(client->connection->all<wire::CharacterRemoved>().size(), 1u);
  EXPECT_EQ(metrics_.groom.grooms_refused_strands.value(), 1u);
}

TEST_F(RoomsPollTest, rooms_that_stay_empty_for_their_grace_count_as_rooms) {
  Config config;
  config.sessions.room_count_max = 3;
  // With a grace of an hour, only the bound of three rooms can close the empty ones. Of 20 rooms that people leave, the
  // server keeps the last two beside the room that is in use.
  config.room_grace_ns = 3'600'000 * kMs;
  start(config);
  const auto stays = join("first");
  for (int i = 0; i < 20; ++i) {
    join("room" + std::to_string(i))->send(wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}, now_ns_);
    run_ms(50, {stays.get()});
  }
  EXPECT_EQ(server_->scheduler().rooms().room_count(), 3u);
  EXPECT_EQ(metrics_.room.rooms_closed.value(), 18u);
  EXPECT_GT(stays->frames(1).size(), 20u);
}

TEST_F(RoomsPollTest, a_wind_lasts_as_long_as_the_session_that_has_set_it) {
  Config config;
  // A session whose connection breaks may come back within half a second; until then its wind lasts.
  config.sessions.resume_grace_ns = 500 * kMs;
  start(config);
  wire::SetWind set;
  set.wind.mean_m_per_s = {6, 0, 0};
  const auto stays = join("garden");
  const auto announced = [&] {
    const auto winds = stays->connection->all<wire::RoomWind>();
    return std::pair(winds.back().session, winds.back().wind.mean_m_per_s.x());
  };
  const auto set_by = [&](FakeClient& client) {
    client.send(set, now_ns_);
    run_ms(400);
    return client.connection->all<wire::Welcome>().back().session;
  };
  const wire::Goodbye leaves{wire::GoodbyeReason::client_leaves, ""};
  const std::pair servers_own(std::uint64_t{0}, 0.0);
  const auto says_goodbye = join("garden");
  const std::uint64_t first = set_by(*says_goodbye);
  EXPECT_EQ(announced(), std::pair(first, 6.0));
  says_goodbye->send(leaves, now_ns_);
  run_ms(400);
  EXPECT_EQ(announced(), servers_own);

  const auto breaks = join("garden");
  const std::uint64_t broken = set_by(*breaks);
  breaks->break_connection(now_ns_);
  run_ms(400);
  EXPECT_EQ(announced(), std::pair(broken, 6.0)) << "it may come back";
  run_ms(600);
  EXPECT_EQ(announced(), servers_own);

  const auto earlier = join("garden");
  set_by(*earlier);
  set.wind.mean_m_per_s = {3, 0, 0};
  const std::uint64_t later = set_by(*stays);
  earlier->send(leaves, now_ns_);
  run_ms(400);
  EXPECT_EQ(announced(), std::pair(later, 3.0)) << "another has set one since";
}

TEST_F(RoomsPollTest, the_wind_of_the_last_visitor_does_not_greet_the_next) {
  start();
  const auto windy = join("garden");
  wire::SetWind set;
  set.wind.mean_m_per_s = {6, 0, 0};
  windy->send(set, now_ns_);
  run_ms(100);
  windy->send(wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}, now_ns_);
  run_ms(10);
  const auto next = join("garden");
  next->pose(1, rigid_pose({}), now_ns_);
  run_ms(500);
  for (const wire::RoomWind& announced : next->connection->all<wire::RoomWind>()) {
    EXPECT_EQ(announced.session, 0u);
    EXPECT_EQ(announced.wind.mean_m_per_s, Vec3::Zero());
  }
  // Four steps are 2 mm (FakeClient::kStep_m). A wind of 6 m/s moves hair much farther.
  EXPECT_TRUE(std::ranges::none_of(next->frames(1).back().displacements, [](int d) { return d > 4; }));
}

TEST_F(RoomsPollTest, a_large_room_is_announced_over_several_ticks_and_frames_follow_the_announcements) {
  start();
  const auto crowd = join("hall", LevelIndex::rigid);
  constexpr std::uint32_t kCount = 600;
  wire::PoseBatch batch;
  for (std::uint32_t character = 2; character <= kCount; ++character)
    crowd->send(wire::AddCharacter{character, hash_, LevelIndex::rigid}, now_ns_);
  for (std::uint32_t character = 1; character <= kCount; ++character)
    batch.poses.push_back({character, 1, now_ns_, false, rigid_pose({})});
  crowd->send(batch, now_ns_);
  run_ms(100);
  FakeClient late(*server_, now_ns_);
  late.hello(now_ns_, "hall");
  crowd->send(wire::RemoveCharacter{kCount}, now_ns_);
  crowd->send(wire::AddCharacter{kCount + 1, hash_, LevelIndex::rigid}, now_ns_);
  // One tick passes in 34 ms. A tick announces 512 members to a new session (kAnnouncementsMax in
  // scheduler_commands.cpp), and a member has no frames before it is announced.
  run_ms(34);
  EXPECT_EQ(late.connection->all<wire::MemberJoined>().size(), 512u);
  EXPECT_EQ(members_seen(late).size(), 512u);
  run_ms(100);
  EXPECT_EQ(late.connection->all<wire::MemberJoined>().size(), kCount);
  EXPECT_THAT(late.connection->all<wire::MemberLeft>(), IsEmpty()) << "it was never announced";
  EXPECT_EQ(members_seen(late).size(), kCount - 1) << "the newest has no pose";
  EXPECT_EQ(crowd->connection->all<wire::CharacterRemoved>().size(), 1u);
}

TEST_F(RoomsPollTest, a_storm_of_resumes_announces_no_more_than_a_tick_has_time_for) {
  Config config;
  config.sessions.resume_interval_ns = 0;
  start(config);
  const auto crowd = join("hall", LevelIndex::rigid);
  for (std::uint32_t character = 2; character <= 400; ++character)
    crowd->send(wire::AddCharacter{character, hash_, LevelIndex::rigid}, now_ns_);
  run_ms(100);
  const wire::Welcome welcome = crowd->connection->all<wire::Welcome>().at(0);
  // A hundred resumes of a session with 400 characters ask for 40 000 announcements. One tick makes 4096 at most
  // (kAnnouncementsOfAllMax in scheduler_commands.cpp).
  std::vector<std::unique_ptr<FakeClient>> resumed;
  for (int i = 0; i < 100; ++i) {
    resumed.push_back(std::make_unique<FakeClient>(*server_, now_ns_));
    resumed.back()->resume(welcome, now_ns_);
  }
  const std::uint64_t before = metrics_.tick.members_announced.value();
  run_ms(34);
  EXPECT_LE(metrics_.tick.members_announced.value() - before, 4096u);
  run_ms(2000);
  EXPECT_EQ(resumed.back()->connection->all<wire::CharacterAdded>().size(), 400u);
}

TEST_F(RoomsPollTest, members_are_chosen_by_place_a_few_times_a_second_and_the_newest_choice_wins) {
  start();
  const auto a = join(), b = join();
  FakeClient watcher(*server_, now_ns_);
  watcher.hello(now_ns_);
  run_ms(300, {a.get(), b.get()});
  wire::Observe observe;
  observe.mode = wire::ObserveMode::nearest;
  // The client changes its place every millisecond for a second, which has 30 ticks. The server chooses by place every
  // 8 ticks (kInterestTicks in scheduler.cpp), so about four times.
  for (int i = 0; i < 1000; ++i) {
    observe.from = Vec3f(static_cast<float>(i), 0, 0);
    observe.count = i < 999 ? 2 : 0;
    watcher.send(observe, now_ns_);
    run_ms(1);
  }
  EXPECT_LE(metrics_.tick.place_choices.value(), 6u);
  run_ms(300, {a.get(), b.get()});
  const std::size_t before = watcher.all_frames().size();
  run_ms(300, {a.get(), b.get()});
  EXPECT_EQ(watcher.all_frames().size(), before) << "none is wanted any more";
}

TEST_F(RoomsPollTest, a_member_that_joins_waits_for_the_next_choice_by_place) {
  start();
  const auto a = join();
  FakeClient watcher(*server_, now_ns_);
  watcher.hello(now_ns_);
  wire::Observe observe;
  observe.mode = wire::ObserveMode::radius;
  observe.from = Vec3f(50, 0, 0);
  observe.radius_m = 1;
  watcher.send(observe, now_ns_);
  run_ms(300, {a.get()});
  const std::uint64_t choices = metrics_.tick.place_choices.value();
  for (std::uint32_t character = 2; character < 12; ++character) {
    a->send(wire::AddCharacter{character, hash_, LevelIndex::low}, now_ns_);
    a->pose(character, moving_pose(now_ns_), now_ns_);
    run_ms(34, {a.get()});
  }
  // Ten ticks pass, and the server chooses by place every 8 ticks (kInterestTicks in scheduler.cpp). A choice for each
  // new member would make a crowd that arrives expensive.
  EXPECT_LE(metrics_.tick.place_choices.value() - choices, 2u);
  EXPECT_THAT(watcher.all_frames(), IsEmpty());
}

TEST_F(RoomsPollTest, the_wind_that_blows_already_wakes_nobody) {
  start();
  const auto sleeper = join();
  sleeper->pose(1, rigid_pose({}), now_ns_);
  // A character falls asleep when its head and its hair have been still for 4.5 s (kSleepAfter_s).
  run_ms(9000);
  ASSERT_TRUE(sleeper->frames(1).back().asleep);
  const std::size_t before = sleeper->all_frames().size();
  for (int i = 0; i < 30; ++i) {
    sleeper->send(wire::SetWind{}, now_ns_);
    run_ms(33);
  }
  EXPECT_EQ(sleeper->all_frames().size(), before);
  EXPECT_EQ(metrics_.tick.winds_changed.value(), 1u) << "the room's first";
}

TEST_F(RoomsPollTest, a_wind_changes_a_few_times_a_second_and_the_newest_wins) {
  start();
  const auto client = join();
  client->pose(1, rigid_pose({}), now_ns_);
  run_ms(100);
  const std::uint64_t before = metrics_.tick.winds_changed.value();
  wire::SetWind set;
  for (int i = 0; i < 100; ++i) {
    set.wind.mean_m_per_s = {-0.1 * i, 0, 0};
    client->send(set, now_ns_);
    run_ms(10);
  }
  // A room's wind changes four times in a second at most (kWindChangesPer_s in scheduler.cpp), and once more at the
  // start of this second.
  EXPECT_LE(metrics_.tick.winds_changed.value() - before, 5u);
  set.wind.mean_m_per_s = {6, 0, 0};
  client->send(set, now_ns_);
  run_ms(1500);
  EXPECT_THAT(client->frames(1).back().displacements, testing::Contains(testing::Gt(4)));
  EXPECT_LE(metrics_.tick.winds_changed.value() - before, 6u);
}

TEST_F(RoomsPollTest, a_crowd_that_comes_and_goes_before_many_observers_is_spread_over_ticks) {
  start();
  // Each character that comes or goes is a message to 100 sessions. One tick sends 32 768 of these at most
  // (kCharacterMessagesMax in scheduler_commands.cpp), which is 328 characters; the others wait for the next tick.
  std::vector<std::unique_ptr<FakeClient>> observers;
  for (int i = 0; i < 99; ++i) {
    observers.push_back(std::make_unique<FakeClient>(*server_, now_ns_));
    observers.back()->hello(now_ns_, "hall");
  }
  const auto crowd = join("hall", LevelIndex::rigid);
  run_ms(100);
  const auto count = [&] { return server_->scheduler().rooms().characters().size(); };
  for (std::uint32_t character = 2; character <= 400; ++character)
    crowd->send(wire::AddCharacter{character, hash_, LevelIndex::rigid}, now_ns_);
  run_ms(34);
  EXPECT_EQ(count(), 329u) << "100 messages each: one tick sends 32 768";
  EXPECT_GT(metrics_.tick.gauges.commands_deferred.value(), 0);
  run_ms(34);
  EXPECT_EQ(count(), 400u);
  EXPECT_EQ(observers.back()->connection->all<wire::MemberJoined>().size(), 400u);
  crowd->send(wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}, now_ns_);
  FakeClient late(*server_, now_ns_);
  late.hello(now_ns_, "hall");
  run_ms(34);
  EXPECT_EQ(count(), 400u - 328u);
  EXPECT_THAT(late.connection->all<wire::MemberJoined>(), IsEmpty()) << "its turn comes after those who left";
  run_ms(34);
  EXPECT_EQ(count(), 0u);
  EXPECT_EQ(observers.back()->connection->all<wire::MemberLeft>().size(), 400u);
  EXPECT_EQ(server_->scheduler().rooms().observers().size(), 100u);
}

}  // namespace
}  // namespace hairnet::server
