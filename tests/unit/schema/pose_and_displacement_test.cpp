#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "schema/wire/messages.hpp"
#include "tests/unit/schema/random_messages.hpp"

namespace hairnet::wire {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(PoseValidation, takes_sound_poses) {
  RandomMessages random(1);
  EXPECT_EQ(validate_pose(Pose{}), PoseRefusal::none);
  for (int round = 0; round < 100; ++round) EXPECT_EQ(validate_pose(random.pose()), PoseRefusal::none);
}

TEST(PoseValidation, rejects_any_bone_that_is_not_finite_not_unit_or_too_far) {
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    const auto refusal_of = [&](auto&& spoil) {
      Pose pose;
      spoil(pose.bones[bone]);
      return validate_pose(pose);
    };
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.rotation.w() = kNan; }), PoseRefusal::not_finite);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.rotation.x() = -kInfinity; }), PoseRefusal::not_finite);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.position.z() = kInfinity; }), PoseRefusal::not_finite);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.rotation.coeffs().setZero(); }), PoseRefusal::not_unit);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.rotation.w() = 1.01; }), PoseRefusal::not_unit);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.rotation.w() = 1e300; }), PoseRefusal::not_unit);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.position.y() = -kPositionMax_m * 1.01; }), PoseRefusal::too_far);
    EXPECT_EQ(refusal_of([](RigidTransform& b) { b.position.y() = -kPositionMax_m; }), PoseRefusal::none);
  }
}

std::vector<Vec3f> random_displacement(RandomMessages& random, std::size_t count, double most_m) {
  std::vector<Vec3f> displacement(count);
  for (Vec3f& d : displacement) {
    for (float& coordinate_m : d) coordinate_m = static_cast<float>(random.real(-most_m, most_m));
  }
  return displacement;
}

TEST(Displacements, come_back_within_half_a_quantum) {
  RandomMessages random(2);
  for (double most_m = 1e-5; most_m < 2e4; most_m *= 1.7) {
    const std::vector<Vec3f> sent = random_displacement(random, 50, most_m);
    Frame frame;
    encode_displacements(sent, frame);
    std::vector<Vec3f> got;
    decode_displacements(frame, got);
    ASSERT_EQ(got.size(), sent.size());
    for (std::size_t i = 0; i < sent.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        const double error_m = std::abs(static_cast<double>(got[i][axis]) - sent[i][axis]);
        EXPECT_LE(error_m, frame.quantum_m / 2.0 + std::ldexp(std::abs(sent[i][axis]), -23));
      }
    }
  }
}

TEST(Displacements, take_the_least_quantum_that_holds_them) {
  RandomMessages random(3);
  for (double most_m = 1e-5; most_m < 2e4; most_m *= 1.7) {
    const std::vector<Vec3f> displacement = random_displacement(random, 50, most_m);
    float largest_m = 0;
    for (const Vec3f& d : displacement) largest_m = std::max(largest_m, d.cwiseAbs().maxCoeff());
    Frame frame;
    encode_displacements(displacement, frame);
    const double exponent = std::log2(static_cast<double>(frame.quantum_m) / kQuantumMin_m);
    EXPECT_EQ(exponent, std::round(exponent)) << "0.1 mm times a power of two";
    EXPECT_LE(largest_m, 32767.0 * frame.quantum_m);
    if (exponent > 0) {
      EXPECT_GT(largest_m, 32767.0 * frame.quantum_m / 2);
    }
  }
}

TEST(Displacements, of_hair_keep_a_twentieth_of_a_millimetre) {
  RandomMessages random(4);
  Frame frame;
  encode_displacements(random_displacement(random, 1000, 3.2), frame);
  EXPECT_EQ(frame.quantum_m, kQuantumMin_m);
}

TEST(Displacements, of_no_node_are_empty) {
  Frame frame;
  frame.quantum_m = 1;
  frame.displacements = {1, 2, 3};
  encode_displacements({}, frame);
  EXPECT_TRUE(frame.displacements.empty());
  EXPECT_EQ(frame.quantum_m, 0);
  std::vector<Vec3f> got(4);
  decode_displacements(frame, got);
  EXPECT_TRUE(got.empty());
}

TEST(Displacements, quantised_twice_are_the_same) {
  RandomMessages random(5);
  Frame once, twice;
  encode_displacements(random_displacement(random, 100, 7), once);
  std::vector<Vec3f> got;
  decode_displacements(once, got);
  encode_displacements(got, twice);
  EXPECT_EQ(once.displacements, twice.displacements);
  EXPECT_EQ(once.quantum_m, twice.quantum_m);
}

TEST(Displacements, beyond_all_quanta_are_cut_off) {
  Frame frame;
  encode_displacements(std::vector<Vec3f>{Vec3f(1e30f, -1e30f, 1)}, frame);
  EXPECT_EQ(frame.quantum_m, kQuantumMax_m);
  EXPECT_EQ(frame.displacements, (std::vector<std::int16_t>{32767, -32767, 1}));
}

}  // namespace
}  // namespace hairnet::wire
