#include "core/pose/complete_pose.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "core/groom/body.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

using support::turned;

TEST(PoseCompletion, a_head_at_rest_gives_the_rest_pose) {
  const RigidTransform head{Quat::Identity(), {1, 1.6, -3}};
  const Pose pose = PoseCompletion(Body{}.joint(Bone::neck)).complete(head, 0);
  for (const RigidTransform& bone : pose.bones) {
    EXPECT_LT((bone.position - head.position).norm(), 1e-12);
    EXPECT_NEAR(bone.rotation.angularDistance(head.rotation), 0, 1e-12);
  }
}

// Many trackers know the head alone, and the other bones are computed from it.
TEST(PoseCompletion, bones_stay_joined_and_the_trunk_upright_for_any_head) {
  const Body body;
  const Vec3 neck_joint = body.joint(Bone::neck);
  std::mt19937 random(3);
  PoseCompletion completion(neck_joint);
  for (int i = 0; i < 500; ++i) {
    const RigidTransform head = turned(4 * static_cast<double>(support::random_vec(random, 1).x()),
                                       support::random_vec(random, 1).cast<double>(), {0, 1.6, 0});
    const Pose pose = completion.complete(head, 1.0 / 60);
    ASSERT_TRUE(is_valid(pose));
    EXPECT_LT((pose[Bone::neck].point(neck_joint) - head.point(neck_joint)).norm(), 1e-12);
    EXPECT_LT((pose[Bone::neck].point(neck_joint) - pose[Bone::upper_trunk].point(neck_joint)).norm(), 1e-12);
    EXPECT_NEAR(pose[Bone::upper_trunk].vector(Vec3::UnitY()).y(), 1, 1e-12);
  }
}

TEST(PoseCompletion, the_neck_takes_half_of_a_nod) {
  const Pose pose = PoseCompletion(Body{}.joint(Bone::neck)).complete(turned(0.6, {1, 0, 0}), 0);
  EXPECT_NEAR(pose[Bone::neck].rotation.angularDistance(turned(0.3, {1, 0, 0}).rotation), 0, 1e-9);
  EXPECT_NEAR(pose[Bone::upper_trunk].rotation.angularDistance(Quat::Identity()), 0, 1e-9);
}

// The lag has a time constant of 0.25 s. After as long, in 15 steps, the trunk must have turned by 1 - 1/e of the
// head's radian.
TEST(PoseCompletion, the_trunk_follows_the_heads_yaw_with_a_first_order_lag) {
  PoseCompletion completion(Body{}.joint(Bone::neck), 0.25);
  completion.complete({}, 0);
  const RigidTransform looking_left = turned(1, {0, 1, 0});
  Pose pose;
  for (int i = 0; i < 15; ++i) pose = completion.complete(looking_left, 0.25 / 15);
  EXPECT_NEAR(pose[Bone::upper_trunk].rotation.angularDistance(Quat::Identity()), 1 - std::exp(-1.0), 1e-9);
}

// A yaw of 3 rad and one of -3 rad are 0.28 rad apart, on the far side of the circle. The trunk must not turn through
// the front.
TEST(PoseCompletion, the_trunk_turns_the_short_way_round) {
  PoseCompletion completion(Body{}.joint(Bone::neck));
  completion.complete(turned(3.0, {0, 1, 0}), 0);
  const Pose pose = completion.complete(turned(-3.0, {0, 1, 0}), 0.1);
  // The whole short way lies within 0.142 rad of looking backwards (pi).
  EXPECT_LT(pose[Bone::upper_trunk].rotation.angularDistance(turned(std::numbers::pi, {0, 1, 0}).rotation), 0.15);
}

}  // namespace
}  // namespace hairnet
