#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "schema/wire/earlier_pose.hpp"
#include "tests/unit/server/session_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using wire::ErrorReason;
using wire::GoodbyeReason;
using State = Session::State;

TEST_F(SessionTest, takes_poses_as_datagrams_once_it_is_active_and_nothing_else) {
  const auto datagram = [&](const wire::Message& message) {
    session_.on_datagram(wire::encode_packet({now_ns_, message}), now_ns_);
  };
  datagram(wire::PoseBatch{});
  EXPECT_EQ(session_.state(), Session::State::awaiting_hello);
  EXPECT_EQ(counters_.datagrams_dropped.value(), 1u);
  hello();
  datagram(wire::PoseBatch{});
  EXPECT_TRUE(errors().empty());
  datagram(wire::SetLevel{1, LevelIndex::low});
  datagram(wire::Goodbye{wire::GoodbyeReason::client_leaves, {}});
  EXPECT_THAT(errors(),
              testing::ElementsAre(wire::ErrorReason::unexpected_message, wire::ErrorReason::unexpected_message));
  EXPECT_EQ(session_.state(), Session::State::active);
  session_.on_datagram(std::vector<std::uint8_t>(40, 1), now_ns_);
  EXPECT_THAT(goodbyes(), testing::ElementsAre(wire::GoodbyeReason::protocol_error));
}

TEST_F(SessionTest, takes_a_pose_that_comes_again_once) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  // Each datagram repeats the two poses before its own, so a lost datagram costs nothing. The sequence numbers wrap
  // from 0xffffffff to 0.
  const auto pose = [begin_ns = now_ns_](std::uint32_t sequence) {
    const std::int64_t captured_ns = 14'000'000 * static_cast<std::int32_t>(sequence);
    return wire::PoseSample{1, sequence, begin_ns + captured_ns, false, rigid_pose({})};
  };
  const auto datagram = [&](const wire::PoseSample& newest, const std::vector<wire::PoseSample>& earlier) {
    now_ns_ += 14'000'000;
    wire::PoseBatch batch{{newest}};
    for (const wire::PoseSample& sample : earlier) batch.earlier.push_back(*wire::to_earlier(sample, newest));
    session_.on_datagram(wire::encode_packet({now_ns_, batch}), now_ns_);
  };
  datagram(pose(0xffffffff), {pose(0xfffffffd), pose(0xfffffffe)});
  datagram(pose(0), {pose(0xfffffffe), pose(0xffffffff)});
  // The one of 1 gets lost.
  datagram(pose(2), {pose(0), pose(1)});
  std::vector<std::uint32_t> taken;
  for (const PutPoses& put : commands<PutPoses>())
    for (const wire::PoseSample& sample : put.poses) taken.push_back(sample.sequence);
  EXPECT_THAT(taken, ElementsAre(0xfffffffd, 0xfffffffe, 0xffffffff, 0, 1, 2));
  EXPECT_EQ(counters_.poses_received.value(), 6u);
  EXPECT_EQ(counters_.poses_repeated.value(), 3u);
  EXPECT_TRUE(errors().empty());
}

TEST_F(SessionTest, poses_that_come_again_cost_nothing_of_the_rate_of_poses) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  const wire::PoseSample before{1, 8, now_ns_, false, rigid_pose({})}, pose{1, 9, now_ns_, false, rigid_pose({})};
  wire::PoseBatch batch{{pose}};
  send(batch);
  batch.earlier.assign(wire::kEarlierPosesMax, *wire::to_earlier(before, pose));
  // These are 400 repeated poses, far more than the 100 that small_limits() allows at once.
  for (int i = 0; i < 25; ++i) send(batch);
  EXPECT_EQ(counters_.poses_repeated.value(), 25 * wire::kEarlierPosesMax);
  EXPECT_EQ(counters_.poses_dropped_over_rate.value(), 0u);
}

// A datagram may overtake the AddCharacter, or be overtaken by the RemoveCharacter, so its sender has made no mistake.
TEST_F(SessionTest, does_not_answer_a_datagram_of_a_character_that_is_not_there) {
  hello();
  session_.on_datagram(wire::encode_packet({now_ns_, one_pose(rigid_pose({}), now_ns_)}), now_ns_);
  EXPECT_TRUE(errors().empty());
  EXPECT_EQ(counters_.poses_rejected_character.value(), 1u);
  send(one_pose(rigid_pose({}), now_ns_));
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::character_unknown)) << "in the channel it is a mistake";
}

TEST_F(SessionTest, refuses_bad_poses_by_reason_one_error_a_second_and_takes_the_good_ones) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  Pose not_finite = rigid_pose({}), not_unit = rigid_pose({});
  not_finite[Bone::neck].position.y() = std::numeric_limits<double>::quiet_NaN();
  not_unit[Bone::head].rotation.coeffs() *= 1.1;
  const Pose too_far = rigid_pose({Quat::Identity(), {0, 2e4, 0}});
  wire::PoseBatch batch;
  for (const Pose& pose : {not_finite, not_unit, too_far, rigid_pose({})})
    batch.poses.push_back({1, static_cast<std::uint32_t>(batch.poses.size() + 1), now_ns_, false, pose});
  batch.poses.push_back({99, 1, now_ns_, false, rigid_pose({})});
  batch.poses.push_back({1, 9, now_ns_ - 3600 * kSecond_ns, false, rigid_pose({})});
  send(batch);
  EXPECT_EQ(counters_.poses_rejected_not_finite.value(), 1u);
  EXPECT_EQ(counters_.poses_rejected_not_unit.value(), 1u);
  EXPECT_EQ(counters_.poses_rejected_too_far.value(), 1u);
  EXPECT_EQ(counters_.poses_rejected_character.value(), 1u);
  EXPECT_EQ(counters_.poses_rejected_time.value(), 1u);
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::pose_invalid));
  const auto puts = commands<PutPoses>();
  ASSERT_EQ(puts.size(), 1u);
  EXPECT_EQ(puts[0].poses.size(), 1u);
  now_ns_ += kSecond_ns;
  send(one_pose(too_far, now_ns_));
  EXPECT_EQ(errors().size(), 2u);
}

TEST_F(SessionTest, drops_and_counts_poses_above_their_rate) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  wire::PoseBatch batch;
  // The 100 poses of small_limits() are enough for the first batch of 80. The second is dropped as a whole.
  batch.poses.assign(80, {1, 1, now_ns_, false, rigid_pose({})});
  send(batch);
  send(batch);
  EXPECT_EQ(counters_.poses_dropped_over_rate.value(), 80u);
  EXPECT_EQ(session_.state(), State::active);
}

TEST_F(SessionTest, poses_that_are_captured_too_close_together_are_left_out) {
  hello();
  for (const std::uint32_t character : {1u, 2u})
    send(wire::AddCharacter{character, groom_service_.known, LevelIndex::low});
  // Two characters have a pose in each of 10 ms. Poses closer than 4 ms are left out (kPoseSpacing_ns in
  // pose_filter.cpp), so the first, fifth and ninth stay. The third pose of character 2 is a teleport, which must not
  // be lost with its pose.
  wire::PoseBatch batch;
  for (std::uint32_t i = 0; i < 10; ++i) {
    now_ns_ += 1'000'000;
    for (const std::uint32_t character : {1u, 2u})
      batch.poses.push_back({character, i + 1, now_ns_, character == 2 && i == 2, rigid_pose({})});
  }
  send(batch);
  EXPECT_EQ(counters_.poses_thinned.value(), 14u);
  const auto puts = commands<PutPoses>();
  ASSERT_EQ(puts.size(), 1u);
  std::vector<std::uint32_t> sequences;
  for (const wire::PoseSample& pose : puts[0].poses) {
    sequences.push_back(pose.sequence);
    EXPECT_EQ(pose.teleport, pose.character == 2 && pose.sequence == 5) << "the next pose has the teleport";
  }
  EXPECT_THAT(sequences, ElementsAre(1, 1, 5, 5, 9, 9));
}

TEST_F(SessionTest, poses_of_a_quick_headset_all_pass) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  for (std::uint32_t i = 1; i <= 90; ++i) {
    now_ns_ += kSecond_ns / 90;
    send(wire::PoseBatch{{{1, i, now_ns_, false, rigid_pose({})}}});
    // Pauses keep the client below the 10 messages a second of small_limits().
    if (i % 9 == 0) now_ns_ += 8 * kSecond_ns / 10;
  }
  EXPECT_EQ(counters_.poses_thinned.value(), 0u);
  EXPECT_EQ(counters_.poses_dropped_over_rate.value(), 0u);
}

TEST_F(SessionTest, closes_a_client_far_above_the_rate_of_poses) {
  hello();
  wire::PoseBatch batch;
  // 640 poses above the rate cost as much as 10 plain messages (kDroppedPosePrice is 1/64), of which 40 may come at
  // once.
  batch.poses.assign(640, {1, 1, now_ns_, false, rigid_pose({})});
  for (int i = 0; i < 3; ++i) send(batch);
  EXPECT_EQ(session_.state(), State::active);
  send(batch);
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::over_rate));
}

}  // namespace
}  // namespace hairnet::server
