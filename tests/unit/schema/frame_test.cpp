#include <gtest/gtest.h>

#include <cmath>

#include "core/pose/complete_pose.hpp"
#include "core/random.hpp"
#include "schema/codec/frame.hpp"
#include "schema/codec/pose_code.hpp"
#include "schema/limits.hpp"

namespace hairnet::codec {
namespace {

double angle(const Quat& a, const Quat& b) {
  return a.angularDistance(b);
}

Quat any_rotation(Random& random) {
  return Quat(random.bell(), random.bell(), random.bell(), random.bell()).normalized();
}

Quat small_rotation(Random& random, double max_rad) {
  const Vec3 axis = Vec3(random.bell(), random.bell(), random.bell()).normalized();
  return Quat(Eigen::AngleAxisd(max_rad * random.symmetric(), axis));
}

// Makes the pose of a person who stands in a hall and looks around: the other bones follow the head as PoseCompletion
// lets them.
Pose natural_pose(Random& random) {
  PoseCompletion completion(Vec3(0, -0.1, -0.02));
  const Vec3 at(5 * random.symmetric(), 1.6, 5 * random.symmetric());
  Pose pose = completion.complete({small_rotation(random, 0.6), at}, 0);
  const Quat yaw(Eigen::AngleAxisd(3 * random.symmetric(), Vec3::UnitY()));
  for (RigidTransform& bone : pose.bones) bone = RigidTransform{yaw, at - yaw * at} * bone;
  return pose;
}

Pose round_trip(const Pose& pose, std::size_t* bytes = nullptr) {
  EncodedFrame frame;
  encode_frame(pose, nullptr, {}, 0, frame);
  if (bytes) *bytes = frame.bytes.size();
  DecodedFrame got;
  EXPECT_TRUE(decode_frame(frame.bytes, nullptr, got));
  return got.pose;
}

TEST(PoseCode, keeps_the_head_precise_anywhere) {
  Random random(1);
  for (int round = 0; round < 2000; ++round) {
    const double far_m = wire::kPositionMax_m * std::pow(10.0, -5 * random.unit());
    const RigidTransform head{any_rotation(random),
                              far_m * Vec3(random.symmetric(), random.symmetric(), random.symmetric())};
    const Pose got = round_trip(rigid_pose(head));
    // A head errs by half a step of kHeadPositionStep_m, and by the rounding of positions to floats.
    EXPECT_LE((got.head().position - head.position).cwiseAbs().maxCoeff(), kHeadPositionStep_m / 2 + 1e-7 * far_m);
    EXPECT_LE(angle(got.head().rotation, head.rotation), 2.5e-4);
  }
}

TEST(PoseCode, keeps_other_bones_within_millimetres_of_any_pose) {
  Random random(2);
  for (int round = 0; round < 2000; ++round) {
    Pose pose = natural_pose(random);
    const bool is_natural = round % 2 != 0;
    if (!is_natural) {
      for (RigidTransform& bone : pose.bones) {
        bone.rotation = any_rotation(random);
        bone.position += 0.3 * Vec3(random.symmetric(), random.symmetric(), random.symmetric());
      }
    }
    const Pose got = round_trip(pose);
    for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
      EXPECT_LE(angle(got.bones[bone].rotation, pose.bones[bone].rotation), is_natural ? 4e-3 : 6e-3) << bone;
      // The positions are compared at a joint below the head, since a rotation error moves the origin of a bone far
      // away from it.
      EXPECT_LE((got.bones[bone].point(Vec3(0, -0.12, 0)) - pose.bones[bone].point(Vec3(0, -0.12, 0))).norm(), 3e-3)
          << bone;
    }
  }
}

TEST(PoseCode, gives_numbers_that_are_floats) {
  Random random(4);
  // g++ 12 may leave out a rounding to float whose result it only compares, so the floats pass through memory.
  std::vector<float> floats;
  for (int round = 0; round < 100; ++round) {
    const Pose got = round_trip(natural_pose(random));
    floats.clear();
    for (const RigidTransform& bone : got.bones) {
      for (const double number : bone.rotation.coeffs()) floats.push_back(static_cast<float>(number));
      for (const double number : bone.position) floats.push_back(static_cast<float>(number));
    }
    auto next = floats.cbegin();
    for (const RigidTransform& bone : got.bones) {
      for (const double number : bone.rotation.coeffs()) ASSERT_EQ(number, *next++);
      for (const double number : bone.position) ASSERT_EQ(number, *next++);
    }
  }
}

// Uncoded, the seven doubles of each of five bones take 280 bytes.
TEST(PoseCode, of_a_bent_body_is_short_and_of_a_still_one_shorter) {
  Random random(3);
  double bytes = 0;
  for (int round = 0; round < 500; ++round) {
    std::size_t size = 0;
    round_trip(natural_pose(random), &size);
    bytes += static_cast<double>(size) / 500;
  }
  EXPECT_LE(bytes, 24);
  std::size_t still = 0;
  round_trip(rigid_pose({Quat::Identity(), Vec3(2, 1.6, -3)}), &still);
  EXPECT_LE(still, 18u);
}

TEST(PoseCode, refuses_positions_out_of_bounds) {
  std::vector<std::uint8_t> bytes(64, 0);
  // The first bits say how many bits each coordinate has; 30 bits of ones are far beyond kPositionMax_m.
  bytes[0] = 30;
  for (std::size_t i = 1; i < 16; ++i) bytes[i] = 0xFF;
  DecodedFrame got;
  EXPECT_FALSE(decode_frame(bytes, nullptr, got));
}

class Coefficients : public testing::Test {
 protected:
  static constexpr std::size_t kModes = 96;
  Coefficients() : random_(7) {
    for (std::size_t k = 0; k < kModes; ++k) deviation_m_.push_back(0.15f / (1 + static_cast<float>(k)));
    code_.emplace(deviation_m_);
  }
  // Draws coefficients of hair that moves `lively` times as much as the deviations say.
  std::vector<float> draw(double lively = 1) {
    std::vector<float> c;
    for (const float deviation : deviation_m_) c.push_back(static_cast<float>(lively * random_.bell()) * deviation);
    return c;
  }
  EncodedFrame encode(std::span<const float> c, unsigned step = 1) {
    EncodedFrame frame;
    encode_frame(Pose{}, &*code_, c, step, frame);
    return frame;
  }
  DecodedFrame decode(std::span<const std::uint8_t> bytes) {
    DecodedFrame got;
    EXPECT_TRUE(decode_frame(bytes, &*code_, got));
    EXPECT_EQ(got.coefficients.size(), kModes);
    return got;
  }
  Random random_;
  std::vector<float> deviation_m_;
  std::optional<CoefficientCode> code_;
};

TEST_F(Coefficients, come_back_within_half_a_step) {
  for (unsigned step = 0; step < kStepCount; ++step) {
    for (const double lively : {0.0, 0.01, 1.0, 30.0}) {
      const std::vector<float> c = draw(lively);
      const std::vector<float> got = decode(encode(c, step).bytes).coefficients;
      const float half_m = std::ldexp(kFinestStep_m, static_cast<int>(step)) / 2;
      // The factor allows for the rounding of floats.
      for (std::size_t k = 0; k < kModes; ++k) ASSERT_NEAR(got[k], c[k], 1.001f * half_m) << step << ", " << k;
    }
  }
}

// A server may cut a frame at any byte to save bandwidth. Whatever is left must decode to the first coefficients, and
// zeros for the others.
TEST_F(Coefficients, cut_off_anywhere_are_the_first_ones) {
  const std::vector<float> c = draw();
  const EncodedFrame frame = encode(c);
  const std::vector<float> whole = decode(frame.bytes).coefficients;
  std::size_t before = 0;
  for (std::size_t size = (frame.pose_bits + 7) / 8; size <= frame.bytes.size(); ++size) {
    const std::vector<float> got = decode(std::span(frame.bytes).first(size)).coefficients;
    std::size_t count = 0;
    while (count < kModes && frame.ends[count] <= 8 * size) ++count;
    for (std::size_t k = 0; k < kModes; ++k) ASSERT_EQ(got[k], k < count ? whole[k] : 0) << size << ", " << k;
    EXPECT_GE(count, before);
    before = count;
  }
  EXPECT_EQ(before, kModes);
}

TEST_F(Coefficients, can_be_asked_for_by_number) {
  const std::vector<float> c = draw();
  const EncodedFrame frame = encode(c);
  const std::vector<float> whole = decode(frame.bytes).coefficients;
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, kModes / 2, kModes, 2 * kModes}) {
    const std::vector<float> got = decode(frame.prefix(count)).coefficients;
    for (std::size_t k = 0; k < std::min(count, kModes); ++k) ASSERT_EQ(got[k], whole[k]);
  }
  EXPECT_LT(frame.prefix(10).size(), frame.prefix(40).size());
  EXPECT_EQ(frame.prefix(kModes).size(), frame.bytes.size());
}

TEST_F(Coefficients, of_calm_hair_take_few_bits) {
  const std::size_t lively = encode(draw(1)).bytes.size(), calm = encode(draw(0.05)).bytes.size();
  const std::size_t still = encode(std::vector<float>(kModes)).bytes.size();
  EXPECT_LT(calm, 0.6 * static_cast<double>(lively));
  // A still pose takes at most 18 bytes, the header of the coefficients less than one, and a zero about a bit; 12 bytes
  // are allowed beyond that.
  EXPECT_LT(still, 18 + 1 + kModes / 8 + 12);
}

TEST_F(Coefficients, out_of_range_are_clamped) {
  std::vector<float> c = draw();
  c[3] = 1e30f;
  c[4] = -1e30f;
  const std::vector<float> got = decode(encode(c, 0).bytes).coefficients;
  // The finest step is 2^-14 m, and a coefficient has at most 2^19 steps, that is 32 m.
  EXPECT_NEAR(got[3], 32, 0.01);
  EXPECT_NEAR(got[4], -32, 0.01);
  // The coefficient behind the clamped ones must not suffer from them.
  EXPECT_NEAR(got[5], c[5], kFinestStep_m);
}

// The decoder reads values from -2^19 to 2^19 - 1 steps. An encoder must be able to write both ends, or a decoded frame
// could not be encoded again.
TEST_F(Coefficients, of_the_whole_range_come_back) {
  constexpr unsigned kStep = kStepCount - 1;
  const float step_m = std::ldexp(kFinestStep_m, static_cast<int>(kStep));
  std::vector<float> c(code_->mode_count(), 0);
  c[0] = std::ldexp(-step_m, 19);
  c[1] = step_m * static_cast<float>((1 << 19) - 1);
  EXPECT_EQ(decode(encode(c, kStep).bytes).coefficients, c);
}

TEST_F(Coefficients, of_any_bytes_are_finite) {
  for (int round = 0; round < 20000; ++round) {
    std::vector<std::uint8_t> bytes(random_.next() % 200);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random_.next());
    // Half of the frames get a head that is near, since random bytes mostly give a position out of bounds, which is
    // refused at once. The first five bits are the width of the head's integers; without the upper two it is at most 7.
    if (!bytes.empty() && round % 2 == 0) bytes[0] &= 0xE7;
    DecodedFrame got;
    if (!decode_frame(bytes, &*code_, got)) continue;
    ASSERT_TRUE(is_valid(got.pose));
    // The largest value is 2^19 of the coarsest steps, 4096 m.
    for (const float c : got.coefficients) ASSERT_TRUE(std::abs(c) <= 5000);
  }
}

TEST_F(Coefficients, refuse_bytes_that_are_left_over) {
  EncodedFrame frame = encode(draw());
  DecodedFrame got;
  frame.bytes.push_back(0);
  EXPECT_FALSE(decode_frame(frame.bytes, &*code_, got));
  EXPECT_FALSE(decode_frame(std::span(frame.bytes).first(3), &*code_, got));
}

TEST_F(Coefficients, are_chosen_by_the_error_that_is_allowed) {
  for (int round = 0; round < 200; ++round) {
    const std::vector<float> c = draw(random_.between(0.1, 3));
    for (const float tolerance_m : {1e-3f, 5e-3f, 2e-2f}) {
      const Detail detail = detail_for(*code_, c, tolerance_m);
      const std::vector<float> got = decode(encode(c, detail.step).prefix(detail.count)).coefficients;
      // The modes are orthonormal, so the error of the hair is the length of the difference of the coefficients.
      double square = 0;
      for (std::size_t k = 0; k < kModes; ++k) square += std::pow(got[k] - c[k], 2);
      EXPECT_LE(std::sqrt(square), 1.0001 * static_cast<double>(tolerance_m));
    }
    EXPECT_LE(detail_for(*code_, c, 2e-2f).count, detail_for(*code_, c, 1e-3f).count);
    EXPECT_GE(detail_for(*code_, c, 2e-2f).step, detail_for(*code_, c, 1e-3f).step);
  }
  EXPECT_EQ(detail_for(*code_, draw(), 0).count, kModes);
  EXPECT_EQ(detail_for(*code_, draw(), 0).step, 0u);
  EXPECT_EQ(detail_for(*code_, draw(), 100).count, 0u);
}

// Tries all steps and all prefixes: none that keeps the tolerance may take fewer bytes than the chosen one, but for 2
// bytes.
TEST_F(Coefficients, take_the_fewest_bytes_for_the_error_that_is_allowed) {
  for (int round = 0; round < 100; ++round) {
    const std::vector<float> c = draw(random_.between(0.1, 3));
    for (const float tolerance_m : {1e-3f, 5e-3f, 2e-2f}) {
      const Detail detail = detail_for(*code_, c, tolerance_m);
      const std::size_t bytes = encode(c, detail.step).prefix(detail.count).size();
      for (unsigned step = 0; step < kStepCount; ++step) {
        const EncodedFrame all = encode(c, step);
        for (std::size_t count = 0; count <= kModes; ++count) {
          // detail_for() estimates the bytes without encoding, so it does not know the exact code of a frame with
          // little motion; 2 bytes are its error.
          if (all.prefix(count).size() + 2 >= bytes) break;
          const std::vector<float> got = decode(all.prefix(count)).coefficients;
          double square = 0;
          for (std::size_t k = 0; k < kModes; ++k) square += std::pow(got[k] - c[k], 2);
          EXPECT_GT(std::sqrt(square), 0.9999 * static_cast<double>(tolerance_m)) << step << ", " << count;
        }
      }
    }
  }
}

}  // namespace
}  // namespace hairnet::codec
