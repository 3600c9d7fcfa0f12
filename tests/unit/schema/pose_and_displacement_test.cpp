#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "schema/wire/messages.hpp"
#include "tests/support/random_messages.hpp"

namespace hairnet::wire {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(PoseValidation, accepts_valid_poses) {
  RandomMessages random(1);
  EXPECT_EQ(validate_pose(Pose{}), PoseRefusal::none);
  for (int round = 0; round < 100; ++round) EXPECT_EQ(validate_pose(random.pose()), PoseRefusal::none);
}

TEST(PoseValidation, rejects_any_bone_that_is_not_finite_not_unit_or_too_far) {
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    const auto refusal_of = [&](auto&& corrupt) {
      Pose pose;
      corrupt(pose.bones[bone]);
      return validate_pose(pose);
    };
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.rotation.w() = kNan; }), PoseRefusal::not_finite);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.rotation.x() = -kInfinity; }), PoseRefusal::not_finite);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.position.z() = kInfinity; }), PoseRefusal::not_finite);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.rotation.coeffs().setZero(); }), PoseRefusal::not_unit);
    // A quaternion may be off unit length by a rounding error, but not by 1 %.
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.rotation.w() = 1.01; }), PoseRefusal::not_unit);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.rotation.w() = 1e300; }), PoseRefusal::not_unit);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.position.y() = -kPositionMax_m * 1.01; }), PoseRefusal::too_far);
    // The limit itself is allowed.
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.position.y() = -kPositionMax_m; }), PoseRefusal::none);
  }
}

}  // namespace
}  // namespace hairnet::wire
