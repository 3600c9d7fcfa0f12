#include "schema/codec/pose_code.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/assert.hpp"
#include "core/geometry/rounded_to_float.hpp"
#include "schema/codec/golomb.hpp"
#include "schema/limits.hpp"

namespace hairnet::codec {
namespace {

using Integers = std::array<std::int32_t, 3>;

constexpr unsigned kPositionWidthBits = 5, kRotationWidthBits = 4;
constexpr unsigned kWidthMax = 30;
constexpr std::uint32_t kAnyRotation = 15;  // instead of a width
constexpr unsigned kHeadBits = kPositionWidthBits + 3 * kWidthMax + 2 + 3 * kRotationBits;
constexpr unsigned kBoneBits = kHeadBits + kRotationWidthBits;
static_assert(kHeadBits + (kBoneCount - 1) * kBoneBits <= 8 * kPoseBytesMax);

// Where bones meet in head space at rest, in most bodies, m. In a body with other joints more bits are left over.
const Vec3 kHeadJoint(0, 0, 0), kNeckJoint(0, -0.10, -0.02), kLeftJoint(0.03, -0.16, -0.01),
    kRightJoint(-0.03, -0.16, -0.01);

Quat rounded(const Quat& q) {
  const Quat unit = q.normalized();
  return {rounded_to_float(unit.w()), rounded_to_float(unit.x()), rounded_to_float(unit.y()),
          rounded_to_float(unit.z())};
}

Integers to_integers(const Vec3& x, double step) {
  constexpr double kMost = (1 << (kWidthMax - 1)) - 1;
  Integers out;
  for (int c = 0; c < 3; ++c) {
    out[static_cast<std::size_t>(c)] =
        static_cast<std::int32_t>(std::clamp(std::nearbyint(x[c] / step), -kMost, kMost));
  }
  return out;
}

Vec3 from_integers(const Integers& integers, double step) {
  return step * Vec3(integers[0], integers[1], integers[2]);
}

unsigned width_of(const Integers& integers) {
  std::uint32_t bits = 0;
  for (const std::int32_t integer : integers) bits |= zigzag(integer);
  return static_cast<unsigned>(std::bit_width(bits));
}

void put_integers(const Integers& integers, unsigned width, BitWriter& writer) {
  for (const std::int32_t integer : integers) writer.put(zigzag(integer), width);
}

Integers take_integers(BitReader& reader, unsigned width) {
  Integers integers;
  for (std::int32_t& integer : integers) integer = unzigzag(static_cast<std::uint32_t>(reader.take(width)));
  return integers;
}

// The quaternion of length 1 whose component `largest` is positive and follows from the three others.
Quat completed(std::size_t largest, const Vec3& others) {
  std::array<double, 4> xyzw{};
  int next = 0;
  for (std::size_t c = 0; c < 4; ++c) xyzw[c] = c == largest ? 0 : others[next++];
  xyzw[largest] = std::sqrt(std::max(1 - others.squaredNorm(), 0.0));
  return Quat(xyzw[3], xyzw[0], xyzw[1], xyzw[2]).normalized();
}

// The three components beside `largest`, of the one of q and -q where that is positive.
Vec3 others_of(const Quat& q, std::size_t largest) {
  const double sign = q.coeffs()[static_cast<Eigen::Index>(largest)] < 0 ? -1 : 1;
  Vec3 out;
  int next = 0;
  for (Eigen::Index c = 0; c < 4; ++c) {
    if (c != static_cast<Eigen::Index>(largest)) out[next++] = sign * q.coeffs()[c];
  }
  return out;
}

// Most necks take half of the head's turn.
Quat halfway(const Quat& a, const Quat& b) {
  const double sign = a.dot(b) < 0 ? -1 : 1;
  return Quat(Eigen::Vector4d(a.coeffs() + sign * b.coeffs())).normalized();
}

constexpr std::size_t kW = 3;  // index in x y z w

// Components of at most sqrt(1/2) in kRotationBits bits.
const double kAnyRotationStep = std::sqrt(0.5) / ((1 << (kRotationBits - 1)) - 1);

class Encoder {
 public:
  Encoder(const Pose& pose, BitWriter& writer) : pose_(pose), writer_(writer) {}

  // The components of any rotation.
  Quat any_rotation(const Quat& q) {
    Eigen::Index largest = 0;
    q.coeffs().cwiseAbs().maxCoeff(&largest);
    const auto index = static_cast<std::size_t>(largest);
    const Integers integers = to_integers(others_of(q, index), kAnyRotationStep);
    writer_.put(index, 2);
    put_integers(integers, kRotationBits, writer_);
    return completed(index, from_integers(integers, kAnyRotationStep));
  }
  Quat any_rotation(Bone bone) { return any_rotation(pose_[bone].rotation); }

  // A rotation that is likely to be near `expected`.
  Quat rotation(Bone bone, const Quat& expected) {
    // Below this w the angle is so large that w would be imprecise.
    constexpr double kNear = 0.5;
    const Quat turn = expected.conjugate() * pose_[bone].rotation;
    if (std::abs(turn.w()) < kNear) {
      writer_.put(kAnyRotation, kRotationWidthBits);
      return expected * any_rotation(turn);
    }
    const Integers integers = to_integers(others_of(turn, kW), kBoneRotationStep);
    const unsigned width = width_of(integers);
    HAIRNET_ASSERT(width < kAnyRotation);
    writer_.put(width, kRotationWidthBits);
    put_integers(integers, width, writer_);
    return expected * completed(kW, from_integers(integers, kBoneRotationStep));
  }

  // The point of a bone at `joint`, in axes turned by `axes`, that is likely to be near `expected`.
  Vec3 point(Bone bone, const Vec3& joint, const Quat& axes, const Vec3& expected, double step) {
    const Integers integers = to_integers(axes.conjugate() * (pose_[bone].point(joint) - expected), step);
    const unsigned width = width_of(integers);
    writer_.put(width, kPositionWidthBits);
    put_integers(integers, width, writer_);
    return expected + axes * from_integers(integers, step);
  }

 private:
  const Pose& pose_;
  BitWriter& writer_;
};

class Decoder {
 public:
  explicit Decoder(BitReader& reader) : reader_(reader) {}

  Quat any_rotation(Bone) {
    const auto index = static_cast<std::size_t>(reader_.take(2));
    return completed(index, from_integers(take_integers(reader_, kRotationBits), kAnyRotationStep));
  }
  Quat rotation(Bone bone, const Quat& expected) {
    const auto width = static_cast<unsigned>(reader_.take(kRotationWidthBits));
    if (width == kAnyRotation) return expected * any_rotation(bone);
    return expected * completed(kW, from_integers(take_integers(reader_, width), kBoneRotationStep));
  }
  Vec3 point(Bone, const Vec3&, const Quat& axes, const Vec3& expected, double step) {
    const auto width = std::min(static_cast<unsigned>(reader_.take(kPositionWidthBits)), kWidthMax);
    return expected + axes * from_integers(take_integers(reader_, width), step);
  }

 private:
  BitReader& reader_;
};

// Each bone is coded from those before it, as the decoder has them.
template <class Coder>
Pose code_pose(Coder coder) {
  Pose pose;
  const auto set = [&pose](Bone bone, const Quat& rotation, const Vec3& point, const Vec3& joint) {
    const Quat q = rounded(rotation);
    const Vec3 position = point - q * joint;
    pose[bone] = {q, {rounded_to_float(position.x()), rounded_to_float(position.y()), rounded_to_float(position.z())}};
  };
  const Vec3 head = coder.point(Bone::head, kHeadJoint, Quat::Identity(), Vec3::Zero(), kHeadPositionStep_m);
  set(Bone::head, coder.any_rotation(Bone::head), head, kHeadJoint);
  const Quat axes = pose.head().rotation;

  const Quat trunk = coder.rotation(Bone::upper_trunk, axes);
  const Quat neck = coder.rotation(Bone::neck, halfway(axes, trunk));
  set(Bone::neck, neck, coder.point(Bone::neck, kHeadJoint, axes, head, kBonePositionStep_m), kHeadJoint);
  const Vec3 neck_joint = pose[Bone::neck].point(kNeckJoint);
  set(Bone::upper_trunk, trunk, coder.point(Bone::upper_trunk, kNeckJoint, axes, neck_joint, kBonePositionStep_m),
      kNeckJoint);
  for (const auto& [bone, joint] :
       {std::pair(Bone::left_shoulder, kLeftJoint), std::pair(Bone::right_shoulder, kRightJoint)}) {
    const Quat shoulder = coder.rotation(bone, trunk);
    const Vec3 expected = pose[Bone::upper_trunk].point(joint);
    set(bone, shoulder, coder.point(bone, joint, axes, expected, kBonePositionStep_m), joint);
  }
  return pose;
}

bool is_within_bounds(const Pose& pose) {
  return std::ranges::all_of(pose.bones, [](const RigidTransform& bone) {
    return bone.position.cwiseAbs().maxCoeff() <= 2 * wire::kPositionMax_m;
  });
}

}  // namespace

Pose encode_pose(const Pose& pose, BitWriter& writer) {
  HAIRNET_ASSERT(is_valid(pose));
  const Pose coded = code_pose(Encoder(pose, writer));
  HAIRNET_ASSERT(is_within_bounds(coded));
  return coded;
}

bool decode_pose(BitReader& reader, Pose& pose) {
  pose = code_pose(Decoder(reader));
  HAIRNET_VALIDATE(is_valid(pose));  // for any bits
  return is_within_bounds(pose);
}

}  // namespace hairnet::codec
