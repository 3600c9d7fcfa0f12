#include "core/geometry/rotation_between.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.hpp"

namespace hairnet {
namespace {

TEST(RotationBetween, turns_one_vector_onto_another_by_the_least_angle) {
  Random random(1);
  const auto vector = [&] { return Vec3(random.symmetric(), random.symmetric(), random.symmetric()); };
  for (int i = 0; i < 1000; ++i) {
    const Vec3 from = vector(), to = 3 * vector();
    const Quat turn = rotation_between(from, to);
    EXPECT_NEAR(turn.norm(), 1, 1e-12);
    EXPECT_LE((turn * from.normalized() - to.normalized()).norm(), 1e-9);
    EXPECT_NEAR(turn.angularDistance(Quat::Identity()), std::acos(from.normalized().dot(to.normalized())), 1e-7);
  }
}

TEST(RotationBetween, of_equal_and_opposite_vectors_is_none_and_half_a_turn) {
  for (const Vec3& from : {Vec3(1, 0, 0), Vec3(0, -2, 0), Vec3(0.3, 0.4, -0.5)}) {
    EXPECT_LE(rotation_between<double>(from, 2 * from).angularDistance(Quat::Identity()), 1e-12);
    EXPECT_LE((rotation_between<double>(from, -from) * from + from).norm(), 1e-12);
    // For nearly opposite vectors the axis of the turn is the cross product of both, which is almost zero here.
    const Vec3 nearly = -from + Vec3(0, 0, 1e-4) * from.norm();
    EXPECT_LE((rotation_between(from, nearly) * from.normalized() - nearly.normalized()).norm(), 1e-8);
  }
}

}  // namespace
}  // namespace hairnet
