#include "client/link/sent_poses.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "schema/wire/earlier_pose.hpp"
#include "tests/unit/client/link_core_driver.hpp"

namespace hairnet::link {
namespace {

using testing::ElementsAre;
using testing::Pair;

// Poses are captured 14 ms apart, as by a 72 Hz headset.
constexpr std::int64_t kPose_ns = 14 * kMs;

wire::PoseSample nth_pose(std::uint32_t character, std::uint32_t sequence) {
  return {character, sequence, sequence * kPose_ns, false, rigid_pose({})};
}

// Each pair is a character and the sequence number of its pose.
using Poses = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
// Returns all poses of a batch, the repeated ones first.
Poses named(const wire::PoseBatch& batch) {
  Poses poses;
  for (const wire::EarlierPose& pose : batch.earlier)
    poses.emplace_back(pose.character, wire::first_of(batch.poses, pose.character)->sequence - pose.sequence_before);
  for (const wire::PoseSample& pose : batch.poses) poses.emplace_back(pose.character, pose.sequence);
  return poses;
}

Poses sent_with(SentPoses& sent, std::vector<wire::PoseSample> poses) {
  wire::PoseBatch batch{std::move(poses)};
  sent.repeat_in(batch);
  return named(batch);
}

TEST(SentPoses, come_again_with_the_next_ones_oldest_first) {
  SentPoses sent;
  EXPECT_THAT(sent_with(sent, {nth_pose(1, 1)}), ElementsAre(Pair(1, 1)));
  EXPECT_THAT(sent_with(sent, {nth_pose(1, 2)}), ElementsAre(Pair(1, 1), Pair(1, 2)));
  EXPECT_THAT(sent_with(sent, {nth_pose(1, 3)}), ElementsAre(Pair(1, 1), Pair(1, 2), Pair(1, 3)));
  EXPECT_THAT(sent_with(sent, {nth_pose(1, 4)}), ElementsAre(Pair(1, 2), Pair(1, 3), Pair(1, 4)));
}

TEST(SentPoses, come_again_with_those_of_their_characters) {
  SentPoses sent;
  for (std::uint32_t i = 1; i <= 2; ++i) sent_with(sent, {nth_pose(1, i), nth_pose(2, i)});
  EXPECT_THAT(sent_with(sent, {nth_pose(1, 3), nth_pose(2, 3)}),
              ElementsAre(Pair(1, 1), Pair(1, 2), Pair(2, 1), Pair(2, 2), Pair(1, 3), Pair(2, 3)));
  EXPECT_THAT(sent_with(sent, {nth_pose(2, 4)}), ElementsAre(Pair(2, 2), Pair(2, 3), Pair(2, 4)));
  EXPECT_THAT(sent_with(sent, {nth_pose(2, 5), nth_pose(2, 6)}),
              ElementsAre(Pair(2, 3), Pair(2, 4), Pair(2, 5), Pair(2, 6)));
}

TEST(SentPoses, that_are_outdated_do_not_come_again) {
  SentPoses sent;
  sent_with(sent, {nth_pose(1, 1)});
  wire::PoseSample late = nth_pose(1, 2);
  late.capture_time_ns = kPose_ns + SentPoses::kAgeMax_ns + 1;
  EXPECT_THAT(sent_with(sent, {late}), ElementsAre(Pair(1, 2)));
}

// Records which poses arrive when a core sends them as datagrams, some of which a test loses.
class PosesOverDatagrams : public testing::Test {
 protected:
  void SetUp() override {
    d.core.start();
    d.core.on_opening(d.now_ns);
    d.core.on_open(d.now_ns, true);
    d.expect<wire::Hello>();
    d.send(welcome_to(5));
    for (const std::uint32_t character : {1u, 2u, 3u}) d.core.send(wire::AddCharacter{character, hash_of(1)});
    d.take_all();
  }
  // Pushes the next pose of each of the characters 1 to `characters`.
  void push(std::uint32_t characters) {
    std::vector<wire::PoseSample> poses;
    ++sequence_;
    for (std::uint32_t c = 1; c <= characters; ++c) poses.push_back(nth_pose(c, sequence_));
    d.core.push_poses(std::move(poses));
  }
  // Takes all packets that the core sends, loses those for which is_lost() is true, and stores the poses of the
  // others. Returns the number of packets.
  std::size_t take(const std::function<bool()>& is_lost) {
    std::size_t count = 0;
    for (std::vector<std::uint8_t> packet = d.core.take_packet(d.now_ns); !packet.empty();
         packet = d.core.take_packet(d.now_ns), ++count) {
      EXPECT_TRUE(d.core.taken_may_be_lost());
      largest_bytes_ = std::max(largest_bytes_, packet.size());
      if (is_lost()) continue;
      const wire::DecodedPacket decoded = wire::decode_packet(packet);
      for (const auto& pose : named(std::get<wire::PoseBatch>(decoded.envelope.message))) come_.insert(pose);
    }
    return count;
  }

  LinkCoreDriver d;
  std::uint32_t sequence_ = 0;
  std::size_t largest_bytes_ = 0;
  std::set<Poses::value_type> come_;
};

TEST_F(PosesOverDatagrams, none_is_missing_though_two_of_three_datagrams_get_lost) {
  // Two of three packets are lost. Each pose is sent in three packets, since it is repeated SentPoses::kPosesMax times.
  std::size_t count = 0;
  for (int i = 0; i < 90; ++i) {
    push(1);
    take([&] { return count++ % 3 != 2; });
  }
  EXPECT_EQ(come_.size(), 90u);
}

TEST_F(PosesOverDatagrams, none_of_three_characters_is_missing_though_two_of_three_datagrams_get_lost) {
  std::size_t count = 0;
  for (int i = 0; i < 90; ++i) {
    push(3);
    take([&] { return count++ % 3 != 2; });
  }
  EXPECT_EQ(come_.size(), 270u);
}

TEST_F(PosesOverDatagrams, of_many_characters_take_several_datagrams) {
  const auto none = [] { return false; };
  for (int i = 0; i < 3; ++i) {
    // A datagram has three characters (kPosesPerDatagram), so 32 take eleven. 32 is kPosesInDatagramsMax
    // (link_core.cpp).
    push(32);
    EXPECT_EQ(take(none), 11u);
  }
  EXPECT_EQ(come_.size(), 96u);
  EXPECT_LE(largest_bytes_, wire::kDatagramBytesMax);
  push(33);
  EXPECT_EQ(take(none), 1u) << "a crowd's poses are one batch for the channel";
}

TEST_F(PosesOverDatagrams, of_a_removed_character_do_not_come_with_those_of_the_next_one_of_its_number) {
  push(1);
  d.take_all();
  d.core.send(wire::RemoveCharacter{1});
  d.core.send(wire::AddCharacter{1, hash_of(1)});
  d.take_all();
  push(1);
  EXPECT_THAT(named(d.expect<wire::PoseBatch>()), ElementsAre(Pair(1, 2)));
}

// Poses of an earlier connection are outdated when the next one opens.
TEST_F(PosesOverDatagrams, of_an_earlier_connection_do_not_come_again) {
  push(1);
  d.take_all();
  d.core.on_closed("the cable", d.now_ns);
  d.core.take_events();
  d.pass_to_deadline();
  d.core.on_opening(d.now_ns);
  d.core.on_open(d.now_ns, true);
  d.expect<wire::Hello>();
  d.send(welcome_to(5, true));
  d.take_all();
  push(1);
  EXPECT_THAT(named(d.expect<wire::PoseBatch>()), ElementsAre(Pair(1, 2)));
}

TEST_F(PosesOverDatagrams, a_jump_travels_alone_and_does_not_come_again) {
  push(1);
  d.take_all();
  // A lost teleport would let the server simulate the jump, so it goes over the channel, which loses nothing.
  wire::PoseSample jump = nth_pose(1, ++sequence_);
  jump.teleport = true;
  d.core.push_poses({jump});
  EXPECT_THAT(named(d.expect<wire::PoseBatch>()), ElementsAre(Pair(1, 2)));
  EXPECT_FALSE(d.core.taken_may_be_lost());
  push(1);
  EXPECT_THAT(named(d.expect<wire::PoseBatch>()), ElementsAre(Pair(1, 1), Pair(1, 3)));
}

TEST(SentPosesWithoutDatagrams, none_comes_again_since_none_gets_lost) {
  LinkCoreDriver d;
  d.connect(welcome_to(5));
  d.take_all();
  for (std::uint32_t i = 1; i <= 3; ++i) {
    d.core.push_poses({nth_pose(1, i), nth_pose(2, i), nth_pose(3, i)});
    EXPECT_EQ(d.expect<wire::PoseBatch>().poses.size(), 3u);
  }
}

}  // namespace
}  // namespace hairnet::link
