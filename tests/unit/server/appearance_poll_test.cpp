#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/fleet/fleet_values.hpp"
#include "server/fleet/local_directory.hpp"
#include "tests/unit/server/poll_fixture.hpp"

// The whole server without a socket: what it tells about tags, appearances and the wind of rooms.
namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

// The colours in sRGB of the hair's root, of its tip and of the skin, and the roughness, where 255 means 1.
constexpr wire::Appearance kRed{{0x9e, 0x59, 0x30}, {0xb0, 0x70, 0x40}, {0xe0, 0xc0, 0xb0}, 77};
constexpr wire::Appearance kGreen{{0, 0x80, 0}, {0, 0xff, 0}, {1, 2, 3}, 255};

class AppearancePollTest : public PollTest {
 protected:
  std::unique_ptr<FakeClient> join(const std::string& tag = "", std::optional<wire::Appearance> appearance = {}) {
    auto client = std::make_unique<FakeClient>(*server_, now_ns_);
    client->hello(now_ns_, "hall");
    client->upload(bytes_, hash_, now_ns_);
    client->send(wire::AddCharacter{1, hash_, LevelIndex::low, {}, tag, appearance}, now_ns_);
    run_ms(50);
    return client;
  }
  void set(FakeClient& client, const std::string& tag, std::optional<wire::Appearance> appearance) {
    client.send(wire::SetAppearance{1, tag, appearance}, now_ns_);
  }
  static std::vector<std::string> tags_of_changes(const FakeClient& client) {
    std::vector<std::string> tags;
    for (const wire::MemberChanged& changed : client.connection->all<wire::MemberChanged>())
      tags.push_back(changed.tag);
    return tags;
  }
};

TEST_F(AppearancePollTest, everyone_else_learns_tag_appearance_and_owner_of_a_member) {
  start();
  const auto ben = join("Ben"), ann = join("Ann", kRed);
  const auto joined = ben->connection->all<wire::MemberJoined>();
  ASSERT_THAT(joined, SizeIs(1));
  EXPECT_EQ(joined[0].tag, "Ann");
  EXPECT_EQ(joined[0].appearance, kRed);
  EXPECT_EQ(joined[0].session, ann->connection->all<wire::Welcome>()[0].session);
  EXPECT_EQ(joined[0].character, 1u);
  EXPECT_EQ(joined[0].member, ann->connection->all<wire::CharacterAdded>()[0].member);
  const auto other = ann->connection->all<wire::MemberJoined>();
  ASSERT_THAT(other, SizeIs(1));
  EXPECT_EQ(other[0].tag, "Ben");
  EXPECT_FALSE(other[0].appearance);
}

TEST_F(AppearancePollTest, a_change_reaches_those_who_are_there_and_late_joiners_but_not_its_owner) {
  start();
  const auto ben = join(), ann = join("Ann", kRed);
  set(*ann, "Anna", kGreen);
  run_ms(100);
  const auto changes = ben->connection->all<wire::MemberChanged>();
  ASSERT_THAT(changes, SizeIs(1));
  EXPECT_EQ(changes[0].member, ann->connection->all<wire::CharacterAdded>()[0].member);
  EXPECT_EQ(changes[0].tag, "Anna");
  EXPECT_EQ(changes[0].appearance, kGreen);
  EXPECT_THAT(ann->connection->all<wire::MemberChanged>(), IsEmpty());
  const auto late = join();
  const auto joined = late->connection->all<wire::MemberJoined>();
  ASSERT_THAT(joined, SizeIs(2));
  EXPECT_EQ(joined[1].tag, "Anna");
  EXPECT_EQ(joined[1].appearance, kGreen);
  EXPECT_THAT(late->connection->all<wire::MemberChanged>(), IsEmpty());
  set(*ann, "Anna", kGreen);
  run_ms(300);
  EXPECT_THAT(ben->connection->all<wire::MemberChanged>(), SizeIs(1)) << "it is the same";
  set(*ann, "", {});
  run_ms(300);
  EXPECT_EQ(tags_of_changes(*ben).back(), "");
  EXPECT_FALSE(ben->connection->all<wire::MemberChanged>().back().appearance);
}

TEST_F(AppearancePollTest, a_character_that_changes_all_the_time_is_told_four_times_a_second_and_at_last_the_newest) {
  start();
  const auto ben = join(), ann = join();
  // The client changes its tag 125 times a second for 2 s. Others hear of it four times a second
  // (kAppearanceChangesPer_s in scheduler_commands.cpp), so some nine times, and of the last change in any case.
  const int count = 250;
  for (int i = 1; i <= count; ++i) {
    set(*ann, std::to_string(i), kRed);
    run_ms(8);
  }
  run_ms(300);
  EXPECT_THAT(tags_of_changes(*ben), SizeIs(testing::AllOf(testing::Ge(7u), testing::Le(10u))));
  EXPECT_EQ(tags_of_changes(*ben).back(), std::to_string(count));
}

TEST_F(AppearancePollTest, a_resumed_session_learns_what_has_changed_meanwhile) {
  start();
  const auto ben = join(), ann = join("Ann", kRed);
  const wire::Welcome welcome = ben->connection->all<wire::Welcome>()[0];
  ben->break_connection(now_ns_);
  run_ms(50);
  set(*ann, "Anna", kGreen);
  run_ms(50);
  FakeClient again(*server_, now_ns_);
  again.resume(welcome, now_ns_);
  run_ms(300);
  const auto joined = again.connection->all<wire::MemberJoined>();
  ASSERT_THAT(joined, SizeIs(1));
  EXPECT_EQ(joined[0].tag, "Anna");
  EXPECT_EQ(joined[0].appearance, kGreen);
}

TEST_F(AppearancePollTest, everyone_learns_the_wind_of_the_room_and_who_has_set_it) {
  Config config;
  config.wind.mean_m_per_s = {2, 0, 1};
  start(config);
  const auto ben = join();
  const auto announced = ben->connection->all<wire::RoomWind>();
  ASSERT_THAT(announced, SizeIs(1));
  EXPECT_EQ(announced[0].wind.mean_m_per_s, Vec3(2, 0, 1));
  EXPECT_EQ(announced[0].session, 0u) << "the server's setting";
  const auto ann = join();
  for (int i = 1; i <= 100; ++i) {
    ann->send(wire::SetWind{{.mean_m_per_s = {0.01 * i, 0, 0}}}, now_ns_);
    run_ms(10);
  }
  run_ms(300);
  const auto ben_announced = ben->connection->all<wire::RoomWind>(),
             ann_announced = ann->connection->all<wire::RoomWind>();
  // The wind changes 100 times within a second.
  EXPECT_LE(ben_announced.size(), 7u) << "a few times a second";
  EXPECT_EQ(ben_announced.back().wind.mean_m_per_s, Vec3(1, 0, 0));
  EXPECT_EQ(ben_announced.back().session, ann->connection->all<wire::Welcome>()[0].session);
  EXPECT_EQ(ann_announced.back().wind.mean_m_per_s, Vec3(1, 0, 0)) << "also the one who has set it";
  const auto late = join();
  ASSERT_THAT(late->connection->all<wire::RoomWind>(), SizeIs(1));
  EXPECT_EQ(late->connection->all<wire::RoomWind>()[0].wind.mean_m_per_s, Vec3(1, 0, 0));
}

TEST_F(AppearancePollTest, a_wind_that_has_come_with_the_room_is_told_as_an_earlier_clients) {
  start();
  LocalDirectory fleet(1, {});
  server_->join_fleet(fleet);
  std::size_t left_out = 0;
  const RoomKept kept{.wind = wire::encode_packet({0, wire::SetWind{{.mean_m_per_s = {1, 2, 3}}}})};
  server_->on_room_claimed("hall", to_value(kept, left_out), now_ns_);
  const auto ben = join();
  ben->send(wire::SetWind{{.mean_m_per_s = {4, 0, 0}}}, now_ns_);
  run_ms(300);
  const auto announced = ben->connection->all<wire::RoomWind>();
  ASSERT_THAT(announced, SizeIs(2));
  EXPECT_EQ(announced[0].wind.mean_m_per_s, Vec3(1, 2, 3));
  EXPECT_EQ(announced[0].session, wire::RoomWind::kOfEarlierServer);
  EXPECT_EQ(announced[1].session, ben->connection->all<wire::Welcome>()[0].session);
}

TEST_F(AppearancePollTest, a_welcome_says_whether_the_wind_may_be_set) {
  Config config;
  config.sessions.wind_from_clients = AllowedClients::participants;
  start(config);
  const auto ann = join();
  EXPECT_TRUE(ann->connection->all<wire::Welcome>()[0].may_set_wind);
  FakeClient observer(*server_, now_ns_);
  wire::Hello hello;
  hello.role = wire::Role::observer;
  observer.send(hello, now_ns_);
  run_ms(50);
  EXPECT_FALSE(observer.connection->all<wire::Welcome>()[0].may_set_wind);
}

TEST_F(AppearancePollTest, tags_that_are_too_long_or_of_others_change_nothing) {
  start();
  const auto ben = join(), ann = join("Ann", kRed);
  // A tag has at most 256 bytes (kTagBytesMax).
  set(*ann, std::string(257, 'x'), kGreen);
  ann->send(wire::SetAppearance{2, "Eve", kGreen}, now_ns_);
  ann->send(wire::AddCharacter{3, hash_, LevelIndex::low, {}, std::string(1000, 'x'), kGreen}, now_ns_);
  run_ms(300);
  EXPECT_THAT(ann->errors(), ElementsAre(wire::ErrorReason::malformed, wire::ErrorReason::character_unknown,
                                         wire::ErrorReason::malformed));
  EXPECT_EQ(metrics_.session.packets_refused_invalid.value(), 2u);
  EXPECT_EQ(metrics_.session.requests_refused_appearance.value(), 1u);
  EXPECT_THAT(ben->connection->all<wire::MemberChanged>(), IsEmpty());
  EXPECT_THAT(ben->connection->all<wire::MemberJoined>(), SizeIs(1));
  EXPECT_FALSE(ann->connection->closed);
}

}  // namespace
}  // namespace hairnet::server
