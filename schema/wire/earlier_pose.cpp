#include "schema/wire/earlier_pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/assert.hpp"

namespace hairnet::wire {
namespace {

// The step of a difference of positions.
constexpr double kMoveStep_m = 5e-5;
// The step of a component of a quaternion.
constexpr double kTurnStep = 1.0 / 32767;
// A turn whose w is smaller, that is of more than 120 degrees, is not sent. The receiver computes w from the three
// other components, which is imprecise for a small w.
constexpr double kMinW = 0.5;

using Shorts = std::array<std::int16_t, 3>;

std::optional<Shorts> to_shorts(const Vec3& x, double step) {
  constexpr double kMax = std::numeric_limits<std::int16_t>::max();
  const Vec3 rounded = (x / step).array().round();
  // The comparison is false for what is not finite, too.
  if (!(rounded.array().abs() <= kMax).all()) return std::nullopt;
  const auto at = [&](Eigen::Index c) { return static_cast<std::int16_t>(rounded[c]); };
  return Shorts{at(0), at(1), at(2)};
}

Vec3 from_shorts(const Shorts& shorts, double step) {
  return step * Vec3(shorts[0], shorts[1], shorts[2]);
}

std::optional<EarlierPose::Bone> to_bone(const RigidTransform& earlier, const RigidTransform& later) {
  Quat turn = earlier.rotation * later.rotation.conjugate();
  // q and -q are the same rotation; the receiver takes w as not negative.
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  const auto turned = to_shorts(turn.vec(), kTurnStep);
  const auto moved = to_shorts(earlier.position - later.position, kMoveStep_m);
  if (!turned || !moved || turn.w() < kMinW) return std::nullopt;
  return EarlierPose::Bone{*turned, *moved};
}

RigidTransform from_bone(const EarlierPose::Bone& bone, const RigidTransform& later) {
  const Vec3 turn = from_shorts(bone.turn, kTurnStep);
  // Any three integers are a valid turn: forged ones may be longer than 1, and give w = 0.
  const double w = std::sqrt(std::max(1 - turn.squaredNorm(), 0.0));
  RigidTransform earlier;
  earlier.rotation = Quat(w, turn.x(), turn.y(), turn.z()).normalized() * later.rotation;
  earlier.position = later.position + from_shorts(bone.move, kMoveStep_m);
  return earlier;
}

}  // namespace

std::optional<EarlierPose> to_earlier(const PoseSample& earlier, const PoseSample& later) {
  HAIRNET_ASSERT(earlier.character == later.character);
  const std::int64_t before_ns = later.capture_time_ns - earlier.capture_time_ns;
  // Sequences wrap, so the difference is modulo 2^32.
  const std::uint32_t sequence_before = later.sequence - earlier.sequence;
  if (before_ns < 0 || before_ns > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  if (sequence_before == 0 || sequence_before > std::numeric_limits<std::uint16_t>::max()) return std::nullopt;
  EarlierPose out;
  out.captured_before_ns = static_cast<std::uint32_t>(before_ns);
  out.character = later.character;
  out.sequence_before = static_cast<std::uint16_t>(sequence_before);
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    const auto bone = to_bone(earlier.pose.bones[b], later.pose.bones[b]);
    if (!bone) return std::nullopt;
    out.bones[b] = *bone;
  }
  return out;
}

PoseSample from_earlier(const EarlierPose& earlier, const PoseSample& later) {
  PoseSample sample;
  sample.character = later.character;
  sample.sequence = later.sequence - earlier.sequence_before;
  sample.capture_time_ns = later.capture_time_ns - earlier.captured_before_ns;
  for (std::size_t b = 0; b < kBoneCount; ++b) sample.pose.bones[b] = from_bone(earlier.bones[b], later.pose.bones[b]);
  // A recording stores floats, so the World must never see a pose that is more precise (recording.hpp).
  sample.pose = rounded_to_wire(sample.pose);
  return sample;
}

const PoseSample* first_of(const std::vector<PoseSample>& poses, std::uint32_t character) {
  const auto found = std::ranges::find(poses, character, &PoseSample::character);
  return found == poses.end() ? nullptr : &*found;
}

}  // namespace hairnet::wire
