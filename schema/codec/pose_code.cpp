#include "schema/codec/pose_code.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"
#include "core/geometry/rounded_to_float.hpp"
#include "schema/codec/integers.hpp"
#include "schema/limits.hpp"

namespace hairnet::codec {
namespace {

constexpr unsigned kRotationWidthBits = 4;
// The width that means a rotation which is coded whole, by its own bits.
constexpr std::uint32_t kAnyRotation = 15;
constexpr unsigned kHeadBits = kPointWidthBits + 3 * kWidthMax + 2 + 3 * kRotationBits;
constexpr unsigned kBoneBits = kHeadBits + kRotationWidthBits;
static_assert(kHeadBits + (kBoneCount - 1) * kBoneBits <= 8 * kPoseBytesMax);

// Where bones meet in head space at rest, m: the default joints of Body (core/groom/body.hpp). For a body with other
// joints the code is right too, but takes more bits.
const Vec3 kHeadJoint(0, 0, 0), kNeckJoint(0, -0.10, -0.02), kLeftJoint(0.03, -0.16, -0.01),
    kRightJoint(-0.03, -0.16, -0.01);

Quat rounded(const Quat& q) {
  const Quat unit = q.normalized();
  return {rounded_to_float(unit.w()), rounded_to_float(unit.x()), rounded_to_float(unit.y()),
          rounded_to_float(unit.z())};
}

// The rotation halfway between two. Most necks take half of the head's turn.
Quat halfway(const Quat& a, const Quat& b) {
  const double sign = a.dot(b) < 0 ? -1 : 1;
  return Quat(Eigen::Vector4d(a.coeffs() + sign * b.coeffs())).normalized();
}

// The index of w in x y z w.
constexpr std::size_t kW = 3;

// Writes the numbers of a pose for code_pose().
class Encoder {
 public:
  Encoder(const Pose& pose, BitWriter& writer) : pose_(pose), writer_(writer) {}

  Quat any_rotation(Bone bone) { return put_rotation(pose_[bone].rotation, writer_); }

  // A rotation that is likely to be near `expected`, written as the turn from there. Returns the rotation as the
  // decoder has it.
  Quat rotation(Bone bone, const Quat& expected) {
    // With a smaller w, that is beyond 120 degrees, w cannot be computed precisely from the other components.
    constexpr double kNear = 0.5;
    // A good guess makes the turn small, and small integers take few bits.
    const Quat turn = expected.conjugate() * pose_[bone].rotation;
    if (std::abs(turn.w()) < kNear) {
      writer_.put(kAnyRotation, kRotationWidthBits);
      return expected * put_rotation(turn, writer_);
    }
    const Integers integers = to_integers(others_of(turn, kW), kBoneRotationStep);
    const unsigned width = width_of(integers);
    HAIRNET_ASSERT(width < kAnyRotation);
    writer_.put(width, kRotationWidthBits);
    put_integers(integers, width, writer_);
    return expected * completed(kW, from_integers(integers, kBoneRotationStep));
  }

  // Where the bone has its `joint`, which is likely to be near `expected`. The difference is written in axes turned by
  // `axes`, in steps of `step`. Returns the point as the decoder has it.
  Vec3 point(Bone bone, const Vec3& joint, const Quat& axes, const Vec3& expected, double step) {
    const Integers integers = to_integers(axes.conjugate() * (pose_[bone].point(joint) - expected), step);
    put_point(integers, writer_);
    return expected + axes * from_integers(integers, step);
  }

 private:
  const Pose& pose_;
  BitWriter& writer_;
};

// Reads what an Encoder has written; the functions are the same.
class Decoder {
 public:
  explicit Decoder(BitReader& reader) : reader_(reader) {}

  Quat any_rotation(Bone) { return take_rotation(reader_); }
  Quat rotation(Bone bone, const Quat& expected) {
    const auto width = static_cast<unsigned>(reader_.take(kRotationWidthBits));
    if (width == kAnyRotation) return expected * any_rotation(bone);
    return expected * completed(kW, from_integers(take_integers(reader_, width), kBoneRotationStep));
  }
  Vec3 point(Bone, const Vec3&, const Quat& axes, const Vec3& expected, double step) {
    return expected + axes * from_integers(take_point(reader_), step);
  }

 private:
  BitReader& reader_;
};

// Codes the bones one after the other. Each is predicted from those before it as the decoder has them, so rounding
// errors do not add up along the body. Encoder and decoder run this one function, so they cannot predict differently.
template <class Coder>
Pose code_pose(Coder coder) {
  Pose pose;
  const auto set = [&pose](Bone bone, const Quat& rotation, const Vec3& point, const Vec3& joint) {
    // The position follows from the rounded rotation, so that the joint stays where it was coded in spite of the
    // rotation's error.
    const Quat q = rounded(rotation);
    const Vec3 position = point - q * joint;
    pose[bone] = {q, {rounded_to_float(position.x()), rounded_to_float(position.y()), rounded_to_float(position.z())}};
  };
  const Vec3 head = coder.point(Bone::head, kHeadJoint, Quat::Identity(), Vec3::Zero(), kHeadPositionStep_m);
  set(Bone::head, coder.any_rotation(Bone::head), head, kHeadJoint);
  const Quat axes = pose.head().rotation;

  // The trunk's rotation comes before the neck's, which is predicted halfway between head and trunk.
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

// Rounding may move a valid position beyond kPositionMax_m. Twice the bound admits each valid pose, and still refuses
// forged positions that are far off.
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
  // Any bits give a valid pose.
  HAIRNET_VALIDATE(is_valid(pose));
  return is_within_bounds(pose);
}

}  // namespace hairnet::codec
