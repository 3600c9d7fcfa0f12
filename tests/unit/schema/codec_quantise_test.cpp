#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/codec_frames.hpp"

namespace hairnet::codec {
namespace {

Quat random_rotation(Random& random) {
  for (;;) {
    const Eigen::Vector4d v(random.symmetric(), random.symmetric(), random.symmetric(), random.symmetric());
    if (v.norm() < 1 && v.norm() > 0.1) return Quat(v.normalized());
  }
}

Pose random_pose(Random& random, double position_m) {
  Pose pose;
  for (RigidTransform& bone : pose.bones) {
    bone.rotation = random_rotation(random);
    bone.position = position_m * Vec3(random.symmetric(), random.symmetric(), random.symmetric());
  }
  return rounded_to_wire(pose);
}

bool same_bits(const Pose& a, const Pose& b) {
  for (std::size_t i = 0; i < kBoneCount; ++i) {
    if (a.bones[i].position != b.bones[i].position) return false;
    if (a.bones[i].rotation.coeffs() != b.bones[i].rotation.coeffs()) return false;
  }
  return true;
}

TEST(PoseIntegers, are_within_a_twentieth_of_a_millimetre_and_a_tenth_of_a_milliradian) {
  Random random(1);
  double turn_max_rad = 0;
  for (int round = 0; round < 50'000; ++round) {
    const Pose pose = random_pose(random, 100);
    FrameIntegers integers;
    quantise_pose(pose, nullptr, integers);
    const Pose got = dequantise_pose(integers);
    ASSERT_TRUE(is_valid(got));
    for (std::size_t i = 0; i < kBoneCount; ++i) {
      ASSERT_LE((got.bones[i].position - pose.bones[i].position).cwiseAbs().maxCoeff(), 0.05e-3);
      turn_max_rad = std::max(turn_max_rad, got.bones[i].rotation.angularDistance(pose.bones[i].rotation));
      ASSERT_NEAR(got.bones[i].rotation.norm(), 1, 1e-6);
    }
  }
  EXPECT_LE(turn_max_rad, 0.1e-3);
}

TEST(PoseIntegers, of_a_rounded_pose_are_the_same_again) {
  Random random(2);
  for (int round = 0; round < 50'000; ++round) {
    FrameIntegers integers, again;
    quantise_pose(random_pose(random, round % 2 ? 3 : 10'000), nullptr, integers);
    const Pose rounded = dequantise_pose(integers);
    ASSERT_TRUE(same_bits(rounded, rounded_to_wire(rounded)));
    quantise_pose(rounded, &integers, again);
    ASSERT_EQ(again.bones, integers.bones);
    ASSERT_TRUE(same_bits(dequantise_pose(again), rounded));
  }
}

TEST(PoseIntegers, keep_to_one_side_when_quaternions_change_sign) {
  Random random(3);
  const Pose from = random_pose(random, 1), to = random_pose(random, 1);
  FrameIntegers last;
  quantise_pose(from, nullptr, last);
  for (int step = 0; step <= 200; ++step) {
    Pose pose = interpolate(from, to, step / 200.0);
    for (RigidTransform& bone : pose.bones) {
      if (random.unit() < 0.5) bone.rotation.coeffs() *= -1;
    }
    FrameIntegers integers;
    quantise_pose(pose, &last, integers);
    for (std::size_t i = 0; i < kBoneIntegers; ++i)
      ASSERT_LT(std::abs(integers.bones[i] - last.bones[i]), 2000) << "step " << step << " integer " << i;
    for (std::size_t i = 0; i < kBoneCount; ++i)
      ASSERT_LT(dequantise_pose(integers).bones[i].rotation.angularDistance(pose.bones[i].rotation), 0.1e-3);
    last = integers;
  }
}

TEST(PoseIntegers, of_q_and_of_its_negative_are_the_same) {
  Random random(4);
  for (int round = 0; round < 1000; ++round) {
    const Pose pose = random_pose(random, 1);
    Pose negated = pose;
    for (RigidTransform& bone : negated.bones) bone.rotation.coeffs() *= -1;
    FrameIntegers a, b;
    quantise_pose(pose, nullptr, a);
    quantise_pose(negated, nullptr, b);
    ASSERT_EQ(a.bones, b.bones);
  }
}

std::vector<Vec3f> random_vectors(Random& random, std::size_t count, double most) {
  std::vector<Vec3f> out(count);
  for (Vec3f& v : out)
    for (float& x : v) x = static_cast<float>(random.between(-most, most));
  return out;
}

float error_max(std::span<const Vec3f> a, std::span<const Vec3f> b) {
  float most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i]).cwiseAbs().maxCoeff());
  return most;
}

TEST(NodeIntegers, are_within_half_a_step_of_their_class) {
  Random random(5);
  for (std::size_t c = 0; c < kErrorClassCount; ++c) {
    const auto error_class = static_cast<ErrorClass>(c);
    for (double most_m = 1e-5; most_m < 32'000 * static_cast<double>(kStep_m[c]); most_m *= 2) {
      const std::vector<Vec3f> sent = random_vectors(random, 100, most_m);
      std::vector<std::int16_t> integers;
      ASSERT_TRUE(quantise_nodes(sent, error_class, integers));
      std::vector<Vec3f> got;
      dequantise_nodes(integers, error_class, got);
      EXPECT_LE(error_max(sent, got), kStep_m[c] / 2 + static_cast<float>(most_m) * 0x1p-22f);
      std::vector<std::int16_t> again;
      quantise_nodes(got, error_class, again);
      EXPECT_EQ(again, integers);
    }
  }
}

TEST(NodeIntegers, say_when_a_coordinate_does_not_fit_and_cut_it_off) {
  for (std::size_t c = 0; c < kErrorClassCount; ++c) {
    const auto error_class = static_cast<ErrorClass>(c);
    const float most_m = 32767 * kStep_m[c];
    std::vector<std::int16_t> integers;
    EXPECT_TRUE(quantise_nodes(std::vector<Vec3f>{{most_m, -most_m, 0}}, error_class, integers));
    EXPECT_EQ(integers, (std::vector<std::int16_t>{32767, -32767, 0}));
    for (const float beyond_m : {most_m * 1.001f, most_m * 1000}) {
      EXPECT_FALSE(quantise_nodes(std::vector<Vec3f>{{0, beyond_m, -beyond_m}}, error_class, integers));
      EXPECT_EQ(integers, (std::vector<std::int16_t>{0, 32767, -32767}));
    }
  }
}

TEST(VelocityIntegers, are_within_half_a_unit_of_their_class) {
  Random random(6);
  for (std::size_t c = 0; c < kErrorClassCount; ++c) {
    const auto error_class = static_cast<ErrorClass>(c);
    const std::vector<Vec3f> sent = random_vectors(random, 200, 30);
    std::vector<std::int16_t> integers;
    quantise_velocities(sent, error_class, integers);
    std::vector<Vec3f> got;
    dequantise_velocities(integers, error_class, got);
    EXPECT_LE(error_max(sent, got), kVelocityStepsPer_s * kStep_m[c] / 2 * 1.001f);
  }
}

}  // namespace
}  // namespace hairnet::codec
