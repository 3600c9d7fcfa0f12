#include "core/pose/pose.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "core/pose/motion.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

using support::turned;

TEST(Pose, rounding_to_the_wire_is_idempotent_and_small) {
  const Pose pose = rigid_pose(turned(1.234, {1, 2, 3}, {1.1, -2.2, 1000.3}));
  const Pose once = rounded_to_wire(pose), twice = rounded_to_wire(once);
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    EXPECT_EQ(once.bones[b].rotation.coeffs(), twice.bones[b].rotation.coeffs());
    EXPECT_EQ(once.bones[b].position, twice.bones[b].position);
    // Floats near 1000 m are 0.06 mm apart.
    EXPECT_LT((once.bones[b].position - pose.bones[b].position).norm(), 1e-4);
    EXPECT_LT(once.bones[b].rotation.angularDistance(pose.bones[b].rotation), 1e-6);
  }
}

TEST(Pose, interpolates_the_short_way_round) {
  Pose a = rigid_pose(turned(0, {0, 1, 0})), b = rigid_pose(turned(1, {0, 1, 0}, {0, 2, 0}));
  for (RigidTransform& bone : b.bones) bone.rotation.coeffs() *= -1;
  const Pose middle = interpolate(a, b, 0.5);
  EXPECT_NEAR(middle.head().rotation.angularDistance(turned(0.5, {0, 1, 0}).rotation), 0, 1e-12);
  EXPECT_NEAR(middle.head().position.y(), 1, 1e-12);
}

TEST(Pose, is_invalid_when_not_finite_or_not_a_rotation) {
  Pose pose;
  EXPECT_TRUE(is_valid(pose));
  pose[Bone::neck].position.x() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(is_valid(pose));
  pose = {};
  pose[Bone::left_shoulder].rotation.coeffs() *= 1.01;
  EXPECT_FALSE(is_valid(pose));
  pose = {};
  pose[Bone::upper_trunk].rotation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(is_valid(pose));
}

TEST(Pose, a_snap_turn_and_a_leap_are_teleports_and_lively_motion_is_not) {
  const Pose rest;
  const Vec3 still = Vec3::Zero();
  // In 1/30 s a quarter turn is 2700 degrees a second, and a metre 30 m/s: above the limits of 2500 and 25. Half a
  // radian and 20 cm are 860 degrees a second and 6 m/s.
  EXPECT_TRUE(is_teleport(rest, rigid_pose(turned(std::numbers::pi / 2, {0, 1, 0})), 1.0 / 30, still));
  EXPECT_TRUE(is_teleport(rest, rigid_pose({Quat::Identity(), {1, 0, 0}}), 1.0 / 30, still));
  EXPECT_FALSE(is_teleport(rest, rigid_pose(turned(0.5, {0, 1, 0}, {0.2, 0, 0})), 1.0 / 30, still));
  const Pose half_a_turn = rigid_pose({Quat(0, 0, 1, 0), Vec3::Zero()});
  EXPECT_TRUE(is_teleport(rest, half_a_turn, 1.0 / 30, still));
  EXPECT_FALSE(is_teleport(rest, half_a_turn, 0.1, still)) << "1800 degrees a second";
  // The length of a rotation on the wire may be off by 1e-3.
  Pose loose = rest;
  for (RigidTransform& bone : loose.bones) bone.rotation.coeffs() *= 0.9991;
  EXPECT_FALSE(is_teleport(loose, loose, 1.0 / 1000, still));
}

TEST(Pose, a_head_that_rides_does_not_jump_however_fast_and_one_that_stops_does_not_either) {
  constexpr double kTick_s = 1.0 / 30;
  for (const double speed : {0.0, 1.0, 10.0, 25.0, 30.0, 100.0, 300.0}) {
    const Vec3 velocity(speed, 0, 0);
    const Pose there = rigid_pose({Quat::Identity(), {9000, 2, 0}});
    const auto moved = [&](const Vec3& by) { return rigid_pose({Quat::Identity(), Vec3(9000, 2, 0) + by}); };
    EXPECT_FALSE(is_teleport(there, moved(kTick_s * velocity), kTick_s, velocity)) << speed;
    EXPECT_FALSE(is_teleport(there, there, kTick_s, velocity)) << speed;
    // The head rides on a circle of 50 m radius.
    const double turn = speed * kTick_s / 50;
    const Vec3 turned_velocity(speed * std::cos(turn), 0, speed * std::sin(turn));
    EXPECT_FALSE(is_teleport(there, moved(kTick_s * turned_velocity), kTick_s, velocity)) << speed;
    // A leap of 12 m in a tick is 360 m/s across the ride, more than the permitted change of 25 m/s and a quarter of
    // the speed before.
    EXPECT_TRUE(is_teleport(there, moved(kTick_s * velocity + Vec3(0, 12, 0)), kTick_s, velocity)) << speed;
    EXPECT_TRUE(is_teleport(there, moved({-500, 0, 0}), kTick_s, velocity)) << speed;
    EXPECT_EQ(velocity_to_expect(there, moved({-500, 0, 0}), kTick_s, velocity), velocity);
  }
}

TEST(RigidTransform, inverse_undoes_and_products_compose) {
  const RigidTransform a = turned(0.7, {1, 1, 0}, {1, 2, 3}), b = turned(-1.3, {0, 1, 2}, {-1, 0, 4});
  const Vec3 x(0.3, -0.2, 0.9);
  EXPECT_LT((a.inverse().point(a.point(x)) - x).norm(), 1e-12);
  EXPECT_LT(((a * b).point(x) - a.point(b.point(x))).norm(), 1e-12);
}

TEST(Motion, keeps_its_ends_and_interpolates_between_but_not_into_a_teleport) {
  Motion motion;
  motion.rate_hz = 10;
  // The clip has three poses, 0.1 s and 1 m apart.
  for (int i = 0; i < 3; ++i) motion.poses.push_back(rigid_pose({Quat::Identity(), {i * 1.0, 0, 0}}));
  EXPECT_NEAR(motion.sample(-1).head().position.x(), 0, 1e-12);
  EXPECT_NEAR(motion.sample(0.05).head().position.x(), 0.5, 1e-12);
  EXPECT_NEAR(motion.sample(9).head().position.x(), 2, 1e-12);
  motion.teleports = {false, true, false};
  EXPECT_NEAR(motion.sample(0.05).head().position.x(), 0, 1e-12);
  EXPECT_NEAR(motion.sample(0.1).head().position.x(), 1, 1e-12);
  EXPECT_TRUE(motion.teleports_within(0.05, 0.1));
  EXPECT_FALSE(motion.teleports_within(0.1, 0.2));
}

TEST(MotionDeathTest, sampling_a_clip_without_poses_stops_the_program) {
  EXPECT_DEATH((void)Motion{}.sample(0), "assertion failed: !poses.empty\\(\\)");
}

}  // namespace
}  // namespace hairnet
