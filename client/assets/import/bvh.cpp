#include "client/assets/import/bvh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "client/assets/import/bvh_file.hpp"
#include "client/assets/import/parse_text.hpp"
#include "client/assets/import/rest_pose.hpp"
#include "core/pose/complete_pose.hpp"
#include "core/shown_text.hpp"

namespace hairnet {
namespace {

constexpr int kNone = -1;
// No coordinate may be larger than 1000 km: poses are later rounded to float.
constexpr double kFarthest_m = 1e6;
using JointOfBone = std::array<int, kBoneCount>;

int find_joint(const BvhFile& file, std::string_view name) {
  const std::string wanted = plain_joint_name(name);
  const auto found =
      std::ranges::find_if(file.joints, [&](const BvhFile::Joint& j) { return plain_joint_name(j.name) == wanted; });
  return found == file.joints.end() ? kNone : static_cast<int>(found - file.joints.begin());
}

// Names in the order of the search. Where a spine or neck has several joints, the uppermost comes first, because it is
// the one that moves the hair.
std::span<const std::string_view> usual_names(Bone bone) {
  static constexpr std::array<std::string_view, 1> kHead{"head"};
  static constexpr std::array<std::string_view, 3> kNeck{"neck2", "neck1", "neck"};
  static constexpr std::array<std::string_view, 8> kLeft{"leftcollar", "lcollar",      "leftclavicle", "lclavicle",
                                                         "claviclel",  "leftshoulder", "lshoulder",    "shoulderl"};
  static constexpr std::array<std::string_view, 8> kRight{"rightcollar", "rcollar",       "rightclavicle", "rclavicle",
                                                          "clavicler",   "rightshoulder", "rshoulder",     "shoulderr"};
  static constexpr std::array<std::string_view, 11> kTrunk{
      "upperchest", "chest4", "chest3", "chest2", "chest", "spine3", "spine2", "spine1", "spine", "thorax", "torso"};
  switch (bone) {
    case Bone::head:
      return kHead;
    case Bone::neck:
      return kNeck;
    case Bone::left_shoulder:
      return kLeft;
    case Bone::right_shoulder:
      return kRight;
    case Bone::upper_trunk:
      return kTrunk;
  }
  return {};
}

// Whether the joint's child is an elbow. Some skeletons call the upper arm a shoulder, and arms do not carry the skin
// that hair lies on.
bool is_upper_arm(const BvhFile& file, int joint) {
  return std::ranges::any_of(file.joints, [joint](const BvhFile::Joint& child) {
    const std::string name = plain_joint_name(child.name);
    return child.parent == joint &&
           (name.find("elbow") != std::string::npos || name.find("forearm") != std::string::npos ||
            name.find("lowerarm") != std::string::npos);
  });
}

// A shoulder that is really an upper arm is skipped, and the search goes on with the next name.
int find_usual_joint(const BvhFile& file, Bone bone) {
  const bool is_shoulder = bone == Bone::left_shoulder || bone == Bone::right_shoulder;
  for (const std::string_view name : usual_names(bone)) {
    const int joint = find_joint(file, name);
    if (joint != kNone && !(is_shoulder && is_upper_arm(file, joint))) return joint;
  }
  return kNone;
}

Result<JointOfBone> find_joints(const BvhFile& file, const BvhImport& import) {
  JointOfBone joints;
  joints.fill(kNone);
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    // A name that the caller gives must exist. A usual name may be missing, since not all skeletons have collar bones.
    if (!import.joint_names[b].empty()) {
      joints[b] = find_joint(file, import.joint_names[b]);
      if (joints[b] == kNone) return Refusal("there is no joint '" + import.joint_names[b] + "'");
      continue;
    }
    joints[b] = find_usual_joint(file, static_cast<Bone>(b));
  }
  // Only the head is necessary: all other bones can follow from it.
  if (joints[0] == kNone) {
    // The list of joints helps to name the head, and is bounded because a file may have thousands.
    constexpr std::size_t kNamesBytesMax = 400;
    std::string names;
    for (const BvhFile::Joint& joint : file.joints) {
      if (names.size() > kNamesBytesMax) {
        names += ", ...";
        break;
      }
      names += (names.empty() ? "" : ", ") + shown(joint.name);
    }
    return Refusal("no joint is called Head; name it by flag, one of: " + names);
  }
  return joints;
}

// The smallest rotation from `up` to +Y; for an upside-down file it is about the axis of the face. The half-way vector
// gives the quaternion directly. The formula loses its axis where both directions are opposite, and is replaced there.
Quat upright_turn(const Vec3& up, const Vec3& face) {
  // Within about 2.6 degrees of upside down, the half-way vector is too short to give an axis.
  if (up.y() < -0.999) return Quat(Eigen::AngleAxisd(std::numbers::pi, face));
  // Twice the cosine of half the angle.
  const double s = std::sqrt(2 * (1 + up.y()));
  Quat turn;
  turn.vec() = up.cross(Vec3::UnitY()) / s;
  turn.w() = s / 2;
  return turn;
}

// Converts file axes and units to the world's. It rotates only the up axis: an actor who faces +x in the file does so
// in the world.
class Conversion {
 public:
  explicit Conversion(const SkeletonRest& rest) : turn_(upright_turn(rest.up, rest.face)), unit_m_(rest.unit_m) {
    const Vec3 face = turn_ * rest.face;
    facing_ = Quat(Eigen::AngleAxisd(std::atan2(face.x(), face.z()), Vec3::UnitY()));
  }
  [[nodiscard]] RigidTransform operator()(const RigidTransform& joint) const {
    return {(turn_ * joint.rotation * turn_.conjugate()).normalized(), unit_m_ * (turn_ * joint.position)};
  }
  // Rotation from head axes to the rest pose's.
  [[nodiscard]] const Quat& facing() const { return facing_; }

 private:
  Quat turn_, facing_;
  double unit_m_;
};

// The flags are checked as a placement, with the usual value for each that is missing. Parallel axes are refused here,
// before they make a singular rotation.
std::string check(const BvhImport& import) {
  Placement given;
  given.up = import.up.value_or(import.face && parallel(*import.face, Axis::plus_y) ? Axis::plus_z : Axis::plus_y);
  given.face = import.face.value_or(parallel(given.up, Axis::plus_z) ? Axis::minus_y : Axis::plus_z);
  given.unit_m = import.unit_m.value_or(1);
  return validate(given);
}

// Values are checked after all conversions, so that an overflow anywhere shows here.
bool is_usable(const Pose& pose) {
  return is_valid(pose) && std::ranges::all_of(pose.bones, [](const RigidTransform& bone) {
           return bone.position.cwiseAbs().maxCoeff() <= kFarthest_m;
         });
}

void warn_of_bones(ImportedMotion& imported) {
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    if (imported.joints[b].empty())
      imported.warnings.push_back("no joint found for the bone " + std::string(kBoneNames[b]) + ": it follows by rule");
  }
}

}  // namespace

Result<RestPose> parse_rest_pose(std::string_view text) {
  if (text == "auto") return RestPose::automatic;
  if (text == "zero") return RestPose::zero;
  if (text == "first") return RestPose::first;
  return Refusal("'" + shown(text) + "' is not one of auto, zero, first");
}

Result<ImportedMotion> decode_bvh(std::string_view text, const BvhImport& import, const Body* body) {
  if (std::string error = check(import); !error.empty()) return Refusal(std::move(error));
  const Result<BvhFile> file = decode_bvh_file(text);
  if (!file) return Refusal(file.error());
  const Result<JointOfBone> joints = find_joints(*file, import);
  if (!joints) return Refusal(joints.error());

  ImportedMotion imported;
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    if ((*joints)[b] != kNone) imported.joints[b] = file->joints[static_cast<std::size_t>((*joints)[b])].name;
  }
  // Only bones whose joint was found may be asked for.
  const auto index = [&](std::size_t b) { return static_cast<std::size_t>((*joints)[b]); };
  const Result<SkeletonRest> rest = find_rest(*file, index(0), import, imported.warnings);
  if (!rest) return Refusal(rest.error());
  warn_of_bones(imported);

  // B = joint(t) joint(rest)^-1 A, where A places head space at the rest pose's head joint, facing in the same
  // direction. The products with joint(rest)^-1 A do not depend on the frame, and are computed once.
  const Conversion convert(*rest);
  const auto at_rest = [&](std::size_t b) { return convert(rest->joint(*file, index(b))); };
  const RigidTransform A{convert.facing(), at_rest(0).position};
  // The product joint(rest)^-1 A of each bone that has a joint.
  std::array<RigidTransform, kBoneCount> from_rest;
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    if ((*joints)[b] != kNone) from_rest[b] = at_rest(b).inverse() * A;
  }
  // Missing bones follow the head by the same rule as those of a headset. The elapsed time is 0 in the first frame,
  // which starts the rule.
  PoseCompletion completion((body ? *body : Body{}).joint(Bone::neck));
  imported.motion.rate_hz = 1 / file->frame_time_s;
  imported.motion.poses.reserve(file->frame_count);
  for (std::size_t frame = 0; frame < file->frame_count; ++frame) {
    const auto bone = [&](std::size_t b) { return convert(file->pose(frame, index(b))) * from_rest[b]; };
    Pose pose = completion.complete(bone(0), frame == 0 ? 0 : file->frame_time_s);
    constexpr auto kTrunk = static_cast<std::size_t>(Bone::upper_trunk);
    if ((*joints)[kTrunk] != kNone) {
      // Shoulders and neck without their own joint move with the trunk that was found.
      pose[Bone::left_shoulder] = pose[Bone::right_shoulder] = bone(kTrunk);
      pose[Bone::neck] = completion.neck(bone(0), bone(kTrunk).rotation);
    }
    // Bone 0 is the head, which `complete` has taken over unchanged.
    for (std::size_t b = 1; b < kBoneCount; ++b) {
      if ((*joints)[b] != kNone) pose.bones[b] = bone(b);
    }
    imported.motion.poses.push_back(pose);
  }
  if (!std::ranges::all_of(imported.motion.poses, is_usable)) return Refusal("the motion's numbers are too large");
  return imported;
}

}  // namespace hairnet
