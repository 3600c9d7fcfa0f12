#include "server/room/pose_inbox.hpp"

#include <gtest/gtest.h>

#include <random>

namespace hairnet::server {
namespace {

using Put = PoseInbox::Put;
using Kind = PoseInbox::Kind;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart_ns = 5'000'000'000;

Pose at_x(double x) {
  return rigid_pose({Quat::Identity(), {x, 0, 0}});
}

// Makes a pose that was captured so many milliseconds after kStart_ns, with the head at this x in metres.
wire::PoseSample timed(std::uint32_t sequence, std::int64_t at_ms, double x, bool teleport = false) {
  return {1, sequence, kStart_ns + at_ms * kMs, teleport, at_x(x)};
}

class PoseInboxTest : public testing::Test {
 protected:
  Put put(const wire::PoseSample& pose) { return inbox_.put(pose, pose.capture_time_ns); }
  PoseInbox::Sample sample(std::int64_t at_ms) { return inbox_.sample(kStart_ns + at_ms * kMs); }
  double x(std::int64_t at_ms) { return sample(at_ms).pose.head().position.x(); }

  PoseInbox inbox_;
};

TEST_F(PoseInboxTest, has_no_sample_before_the_first_pose) {
  EXPECT_EQ(sample(0).kind, Kind::none);
}

TEST_F(PoseInboxTest, returns_the_first_pose_at_times_before_it) {
  put(timed(1, 0, 3));
  EXPECT_EQ(sample(-25).kind, Kind::clamped);
  EXPECT_EQ(x(-25), 3);
}

TEST_F(PoseInboxTest, is_exact_on_linear_motion_at_any_arrival_times) {
  std::mt19937 random(1);
  // Poses are captured every 15 ms with a jitter of 3 ms. They are sampled every 7 ms, 25 ms late, so always between
  // two of them.
  std::uniform_real_distribution<double> jitter(-3, 3);
  std::int64_t sampled_ms = 0;
  for (int i = 0; i < 200; ++i) {
    const auto at_ms = static_cast<std::int64_t>(15 * i + jitter(random));
    ASSERT_EQ(put(timed(static_cast<std::uint32_t>(i + 1), at_ms, 0.002 * static_cast<double>(at_ms))), Put::accepted);
    for (; sampled_ms < at_ms - 25; sampled_ms += 7) {
      if (sampled_ms > 20) {
        ASSERT_NEAR(x(sampled_ms), 0.002 * static_cast<double>(sampled_ms), 1e-9);
      }
    }
  }
}

TEST_F(PoseInboxTest, turns_at_constant_rate_between_two_rotations) {
  const auto turned = [](double angle) {
    return rigid_pose({Quat(Eigen::AngleAxisd(angle, Vec3::UnitY())), Vec3::Zero()});
  };
  inbox_.put({1, 1, kStart_ns, false, turned(0)}, kStart_ns);
  inbox_.put({1, 2, kStart_ns + 20 * kMs, false, turned(0.4)}, kStart_ns + 20 * kMs);
  EXPECT_NEAR(sample(5).pose.head().rotation.angularDistance(Quat::Identity()), 0.1, 1e-9);
  EXPECT_NEAR(sample(15).pose.head().rotation.angularDistance(Quat::Identity()), 0.3, 1e-9);
}

// Poses of 57 to 77 Hz do not fit ticks of 30 Hz. A sampler that took the newest pose would be wrong by up to a pose,
// and so by 0.6 m/s at the speed of this head. Interpolation keeps the velocity smooth.
TEST_F(PoseInboxTest, irregular_arrivals_sampled_at_the_tick_rate_give_a_smooth_velocity) {
  std::mt19937 random(7);
  std::uniform_int_distribution<std::int64_t> interval_us(13'000, 17'500);
  const auto truth = [](double t_s) { return 0.3 * std::sin(4 * t_s); };
  std::int64_t captured_ns = 0, tick_ns = 200 * kMs;
  std::uint32_t sequence = 0;
  double last_x = 0, last_v = 0, worst_v = 0, worst_a = 0;
  int ticks = 0;
  constexpr double kTick_s = 1.0 / 30;
  while (captured_ns < 5'000 * kMs) {
    captured_ns += interval_us(random) * 1000;
    inbox_.put({1, ++sequence, kStart_ns + captured_ns, false, at_x(truth(static_cast<double>(captured_ns) * 1e-9))},
               kStart_ns + captured_ns);
    for (; tick_ns <= captured_ns - 25 * kMs; tick_ns += 33'333'333) {
      const double now_x = inbox_.sample(kStart_ns + tick_ns).pose.head().position.x();
      const double v = (now_x - last_x) / kTick_s, mid_s = static_cast<double>(tick_ns) * 1e-9 - kTick_s / 2;
      if (++ticks > 2) {
        worst_v = std::max(worst_v, std::abs(v - 1.2 * std::cos(4 * mid_s)));
        worst_a = std::max(worst_a, std::abs(v - last_v) / kTick_s);
      }
      last_x = now_x;
      last_v = v;
    }
  }
  EXPECT_GT(ticks, 100);
  // The greatest velocity is 1.2 m/s, and the greatest acceleration 4.8 m/s^2. Lines between poses 17.5 ms apart differ
  // from this curve by 0.2 mm at most, and so in velocity by 0.012 m/s.
  EXPECT_LT(worst_v, 0.02);
  EXPECT_LT(worst_a, 6);
}

TEST_F(PoseInboxTest, extrapolates_along_the_last_poses_for_50_ms_and_then_stops) {
  put(timed(1, 0, 0));
  put(timed(2, 20, 0.2));
  EXPECT_EQ(sample(45).kind, Kind::extrapolated);
  EXPECT_NEAR(x(45), 0.45, 1e-9);
  EXPECT_NEAR(x(70), 0.7, 1e-9);
  EXPECT_EQ(sample(71).kind, Kind::stale);
  EXPECT_NEAR(x(71), 0.7, 1e-9);
  EXPECT_NEAR(x(60'000), 0.7, 1e-9);
}

TEST_F(PoseInboxTest, a_head_that_rides_goes_on_while_poses_are_missing_and_stops_with_a_teleport_at_last) {
  // This head moves at 100 m/s, faster than any person: it rides (above kRideLeast_m_per_s, 13 m/s), and so goes on for
  // a second (kRideMax_ns) in place of 50 ms.
  put(timed(1, 0, 0));
  put(timed(2, 20, 2));
  for (std::int64_t at_ms = 20; at_ms <= 1020; at_ms += 20) {
    EXPECT_NEAR(x(at_ms), 0.1 * static_cast<double>(at_ms), 1e-6) << at_ms;
    EXPECT_FALSE(sample(at_ms).teleport);
  }
  EXPECT_EQ(sample(200).kind, Kind::stale);
  EXPECT_TRUE(sample(1021).teleport);
  EXPECT_FALSE(sample(1040).teleport) << "once";
  EXPECT_NEAR(x(60'000), 102, 1e-6);
  put(timed(3, 60'000, 6000));
  put(timed(4, 60'020, 6002));
  EXPECT_NEAR(x(60'010), 6001, 1e-6);
}

TEST_F(PoseInboxTest, does_not_throw_the_jitter_of_two_close_poses_far) {
  put(timed(1, 0, 0));
  put(timed(2, 20, 0.2));
  // The last two poses alone would give a velocity of 50 m/s. They are closer than kSlopeLeast_ns (8 ms), so an earlier
  // pose counts.
  put(timed(3, 21, 0.25));
  EXPECT_LT(x(71), 0.25 + 0.05 * 0.25 / 0.021 + 1e-9);
}

TEST_F(PoseInboxTest, rejects_poses_that_are_not_newer) {
  EXPECT_EQ(put(timed(5, 100, 0)), Put::accepted);
  EXPECT_EQ(put(timed(5, 110, 0)), Put::out_of_order);
  EXPECT_EQ(put(timed(4, 120, 0)), Put::out_of_order);
  EXPECT_EQ(put(timed(6, 100, 0)), Put::out_of_order);
  EXPECT_EQ(put(timed(6, 90, 0)), Put::out_of_order);
  EXPECT_EQ(put(timed(6, 101, 0)), Put::accepted);
}

TEST_F(PoseInboxTest, takes_sequences_that_wrap) {
  EXPECT_EQ(put(timed(0xffffffff, 0, 0)), Put::accepted);
  EXPECT_EQ(put(timed(0, 10, 0)), Put::accepted);
  EXPECT_EQ(put(timed(0xfffffffe, 20, 0)), Put::out_of_order);
}

TEST_F(PoseInboxTest, rejects_poses_from_more_than_a_second_away) {
  const std::int64_t now_ns = kStart_ns + 10'000 * kMs;
  // The bounds are kAgeMax_ns and kLeadMax_ns, a second each.
  EXPECT_EQ(inbox_.put(timed(1, 8'999, 0), now_ns), Put::stale);
  EXPECT_EQ(inbox_.put(timed(1, 11'001, 0), now_ns), Put::future);
  EXPECT_EQ(inbox_.put(timed(1, 9'001, 0), now_ns), Put::accepted);
  EXPECT_EQ(inbox_.put(timed(2, 10'999, 0), now_ns), Put::accepted);
}

TEST_F(PoseInboxTest, a_teleport_happens_at_its_time_and_is_reported_once) {
  put(timed(1, 0, 0));
  put(timed(2, 20, 10, true));
  put(timed(3, 40, 10));
  EXPECT_EQ(x(19), 0);
  EXPECT_FALSE(sample(19).teleport);
  const auto after = sample(21);
  EXPECT_TRUE(after.teleport);
  EXPECT_EQ(after.pose.head().position.x(), 10);
  EXPECT_FALSE(sample(22).teleport);
}

TEST_F(PoseInboxTest, a_teleport_is_not_extrapolated_across) {
  put(timed(1, 0, 0));
  put(timed(2, 20, 10, true));
  EXPECT_EQ(x(60), 10);
}

TEST_F(PoseInboxTest, a_teleport_that_arrives_late_is_still_reported) {
  put(timed(1, 0, 0));
  sample(40);
  inbox_.put(timed(2, 20, 10, true), kStart_ns + 41 * kMs);
  EXPECT_TRUE(sample(42).teleport);
}

TEST_F(PoseInboxTest, the_teleport_of_an_overtaken_pose_passes_to_the_next_one) {
  put(timed(1, 0, 0));
  put(timed(3, 20, 5));
  EXPECT_EQ(put(timed(2, 10, 5, true)), Put::out_of_order);
  put(timed(4, 30, 5));
  EXPECT_TRUE(sample(30).teleport);
  put(timed(5, 40, 5));
  EXPECT_FALSE(sample(40).teleport) << "once";
  EXPECT_EQ(put(timed(5, 40, 5, true)), Put::out_of_order) << "the same pose again says nothing new";
  put(timed(6, 50, 5));
  EXPECT_FALSE(sample(50).teleport);
}

TEST_F(PoseInboxTest, a_teleport_is_not_lost_in_a_burst_of_poses) {
  put(timed(1, 0, 0));
  sample(1);
  put(timed(2, 2, 5, true));
  // More poses than kPosesMax push the one with the teleport out of the inbox.
  for (std::uint32_t i = 0; i < 4 * PoseInbox::kPosesMax; ++i) put(timed(3 + i, 3 + i, 5));
  EXPECT_TRUE(sample(200).teleport);
}

}  // namespace
}  // namespace hairnet::server
