#include <algorithm>
#include <cmath>

#include "core/assert.hpp"
#include "core/geometry/rounded_to_float.hpp"
#include "schema/codec/frame_codec.hpp"
#include "schema/limits.hpp"

namespace hairnet::codec {
namespace {

constexpr float kIntegerMax = 32767;  // symmetric: -32768 never occurs

// Rounds to the nearest integer, for any float up to 2^22: beyond 2^23 floats have no fraction. Unlike std::nearbyint
// it compiles to four lanes in the instruction set that we build for.
float nearest(float x) {
  constexpr float kNoFraction = 1.5f * (1 << 23);
  return (x + kNoFraction) - kNoFraction;
}

std::int32_t to_integer(double x) {
  constexpr double kMax = 2147483647;
  return static_cast<std::int32_t>(std::clamp(std::nearbyint(x), -kMax, kMax));
}

// Returns true when all values fitted. 3 integers for each vector.
bool quantise(std::span<const Vec3f> vectors, float unit, std::vector<std::int16_t>& out) {
  HAIRNET_ASSERT(unit > 0);
  out.resize(3 * vectors.size());
  if (vectors.empty()) return true;
  const float* value = vectors.front().data();
  const float per_unit = 1 / unit;
  float most = 0;
  for (std::int16_t& integer : out) {
    const float units = *value++ * per_unit;
    most = std::max(most, std::abs(units));
    integer = static_cast<std::int16_t>(nearest(std::min(std::max(units, -kIntegerMax), kIntegerMax)));
  }
  return most < kIntegerMax + 0.5f;
}

void dequantise(std::span<const std::int16_t> integers, float unit, std::vector<Vec3f>& vectors) {
  HAIRNET_ASSERT(integers.size() % 3 == 0);
  vectors.resize(integers.size() / 3);
  const std::int16_t* integer = integers.data();
  for (Vec3f& v : vectors) {
    for (float& value : v) value = unit * static_cast<float>(*integer++);
  }
}

float step_m(ErrorClass error_class) {
  HAIRNET_ASSERT(static_cast<std::size_t>(error_class) < kErrorClassCount);
  return kStep_m[static_cast<std::size_t>(error_class)];
}

using Quaternion = std::array<std::int32_t, 4>;

Quaternion quantise_rotation(const Quat& rotation) {
  Quaternion out;
  for (int c = 0; c < 4; ++c) out[static_cast<std::size_t>(c)] = to_integer(rotation.coeffs()[c] / kRotationStep);
  return out;
}

Quat dequantise_rotation(const std::int32_t* integers) {
  const Quat q(integers[3], integers[0], integers[1], integers[2]);
  const double norm = std::sqrt(q.x() * q.x() + q.y() * q.y() + q.z() * q.z() + q.w() * q.w());
  if (!(norm > 0)) return Quat::Identity();
  return Quat(rounded_to_float(q.w() / norm), rounded_to_float(q.x() / norm), rounded_to_float(q.y() / norm),
              rounded_to_float(q.z() / norm));
}

// Finds integers whose rotation quantises to the same integers again: rounding leaves a length that is not exactly 1,
// and normalising may move a component to the next integer.
Quaternion settled(Quaternion integers) {
  constexpr int kRoundsMax = 8;  // one or two suffice
  for (int round = 0; round < kRoundsMax; ++round) {
    const Quaternion again = quantise_rotation(dequantise_rotation(integers.data()));
    if (again == integers) break;
    integers = again;
  }
  return integers;
}

double dot(const Quat& q, const std::int32_t* integers) {
  return q.x() * integers[0] + q.y() * integers[1] + q.z() * integers[2] + q.w() * integers[3];
}

}  // namespace

void quantise_pose(const Pose& pose, const FrameIntegers* last, FrameIntegers& out) {
  HAIRNET_ASSERT(is_valid(pose));
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    std::int32_t* integers = out.bones.data() + kIntegersPerBone * bone;
    // Chooses q or -q: near the last frame's quaternion, or near the previous bone's.
    const Quat& q = pose.bones[bone].rotation;
    double side = q.w();
    if (last) {
      side = dot(q, last->bones.data() + kIntegersPerBone * bone + 3);
    } else if (bone > 0) {
      side = dot(q, integers - kIntegersPerBone + 3);
    }
    const Vec3& position = pose.bones[bone].position;
    HAIRNET_ASSERT(position.cwiseAbs().maxCoeff() <= wire::kPositionMax_m);
    for (int c = 0; c < 3; ++c) {
      // Far from the origin a float is coarser than a step.
      const double steps =
          rounded_to_float(to_integer(position[c] / kPositionStep_m) * kPositionStep_m) / kPositionStep_m;
      integers[c] = to_integer(steps);
    }
    const Quaternion rotation = settled(quantise_rotation(side < 0 ? Quat(-q.w(), -q.x(), -q.y(), -q.z()) : q));
    std::ranges::copy(rotation, integers + 3);
  }
}

Pose dequantise_pose(const FrameIntegers& integers) {
  Pose pose;
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    const std::int32_t* from = integers.bones.data() + kIntegersPerBone * bone;
    for (int c = 0; c < 3; ++c) pose.bones[bone].position[c] = rounded_to_float(from[c] * kPositionStep_m);
    pose.bones[bone].rotation = dequantise_rotation(from + 3);
  }
  HAIRNET_VALIDATE(is_valid(pose));  // for any integers
  return pose;
}

bool quantise_nodes(std::span<const Vec3f> displacement, ErrorClass error_class, std::vector<std::int16_t>& out) {
  return quantise(displacement, step_m(error_class), out);
}

void dequantise_nodes(std::span<const std::int16_t> nodes, ErrorClass error_class, std::vector<Vec3f>& displacement) {
  dequantise(nodes, step_m(error_class), displacement);
}

void quantise_velocities(std::span<const Vec3f> velocity, ErrorClass error_class, std::vector<std::int16_t>& out) {
  quantise(velocity, kVelocityStepsPer_s * step_m(error_class), out);
}

void dequantise_velocities(std::span<const std::int16_t> velocities, ErrorClass error_class,
                           std::vector<Vec3f>& velocity) {
  dequantise(velocities, kVelocityStepsPer_s * step_m(error_class), velocity);
}

}  // namespace hairnet::codec
