#include "core/import/bvh.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <span>

#include "core/import/bvh_file.hpp"
#include "core/import/text.hpp"
#include "core/pose/complete_pose.hpp"

namespace hairnet {
namespace {

constexpr int kNone = -1;
using JointOfBone = std::array<int, kBoneCount>;

// "mixamorig:Left_Shoulder" -> "leftshoulder"
std::string plain(std::string_view name) {
  name.remove_prefix(name.find_last_of(':') + 1);  // npos + 1 = 0
  std::string out;
  for (const unsigned char letter : name) {
    if (std::isalnum(letter)) out += static_cast<char>(std::tolower(letter));
  }
  return out;
}

int find_joint(const BvhFile& file, std::string_view name) {
  const std::string wanted = plain(name);
  const auto found =
      std::ranges::find_if(file.joints, [&](const BvhFile::Joint& j) { return plain(j.name) == wanted; });
  return found == file.joints.end() ? kNone : static_cast<int>(found - file.joints.begin());
}

// Names in the order in which they are looked for; where a spine or neck has several joints, the uppermost comes first.
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

// Whether an elbow hangs right on it. Some skeletons call the upper arm a shoulder, and arms do not carry the skin that
// hair lies on.
bool is_upper_arm(const BvhFile& file, int joint) {
  return std::ranges::any_of(file.joints, [joint](const BvhFile::Joint& child) {
    const std::string name = plain(child.name);
    return child.parent == joint &&
           (name.find("elbow") != std::string::npos || name.find("forearm") != std::string::npos ||
            name.find("lowerarm") != std::string::npos);
  });
}

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
    if (!import.joint_names[b].empty()) {
      joints[b] = find_joint(file, import.joint_names[b]);
      if (joints[b] == kNone) return Refusal("there is no joint '" + import.joint_names[b] + "'");
      continue;
    }
    joints[b] = find_usual_joint(file, static_cast<Bone>(b));
  }
  if (joints[0] == kNone) {
    std::string names;
    for (const BvhFile::Joint& joint : file.joints) names += (names.empty() ? "" : ", ") + shown(joint.name);
    return Refusal("no joint is called Head; name it by flag, one of: " + names.substr(0, 400));
  }
  return joints;
}

// The least turn that brings `up` to +Y; a head over heels file turns about the axis its face looks along.
Quat upright_turn(Axis up, Axis face) {
  if (up == Axis::minus_y) return Quat(Eigen::AngleAxisd(std::numbers::pi, direction(face)));
  return Quat::FromTwoVectors(direction(up), Vec3::UnitY());
}

// From file axes and units to the world's. Only up is turned: an actor who faces +x in the file does so in the world.
class Conversion {
 public:
  explicit Conversion(const BvhImport& import)
      : turn_(upright_turn(import.up, import.face)),
        facing_(turn_ * Quat(rotation_to_head(import.up, import.face)).conjugate()),
        unit_m_(import.unit_m) {}
  [[nodiscard]] RigidTransform operator()(const RigidTransform& joint) const {
    return {(turn_ * joint.rotation * turn_.conjugate()).normalized(), unit_m_ * (turn_ * joint.position)};
  }
  // From head axes to the bind pose's.
  [[nodiscard]] const Quat& facing() const { return facing_; }

 private:
  Quat turn_, facing_;
  double unit_m_;
};

// Between the lowest and the highest joint of the bind pose.
double height_m(const BvhFile& file, const Conversion& convert) {
  // Parents come before their children: no joint's chain is walked twice.
  std::vector<Vec3> at;
  double low = 0, high = 0;
  for (const BvhFile::Joint& joint : file.joints) {
    at.push_back(joint.parent < 0 ? joint.offset : at[static_cast<std::size_t>(joint.parent)] + joint.offset);
    const double y = convert({Quat::Identity(), at.back()}).position.y();
    low = at.size() == 1 ? y : std::min(low, y);
    high = at.size() == 1 ? y : std::max(high, y);
  }
  return high - low;
}

void warn(const BvhFile& file, const Conversion& convert, const BvhImport& import, ImportedMotion& imported) {
  const double tall_m = height_m(file, convert);
  if (!(tall_m >= 0.4 && tall_m <= 3)) {
    char text[160];
    std::snprintf(text, sizeof text, "the skeleton is %.3g m tall; --unit %.3g would make it a person", tall_m,
                  tall_m > 0 ? import.unit_m * 1.6 / tall_m : import.unit_m);
    imported.warnings.emplace_back(text);
  }
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    if (imported.joints[b].empty())
      imported.warnings.push_back("no joint found for the bone " + std::string(kBoneNames[b]) + ": it follows by rule");
  }
}

}  // namespace

Result<ImportedMotion> decode_bvh(std::string_view text, const BvhImport& import, const Body* body) {
  const Placement axes{import.up, import.face, import.unit_m, {}};
  if (std::string fault = validate(axes); !fault.empty()) return Refusal(std::move(fault));
  const Result<BvhFile> file = decode_bvh_file(text);
  if (!file) return Refusal(file.error());
  const Result<JointOfBone> joints = find_joints(*file, import);
  if (!joints) return Refusal(joints.error());

  ImportedMotion imported;
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    if ((*joints)[b] != kNone) imported.joints[b] = file->joints[static_cast<std::size_t>((*joints)[b])].name;
  }
  const Conversion convert(import);
  warn(*file, convert, import, imported);

  // B = joint(t) joint(bind)^-1 A, A placing head space at the bind pose's head joint, facing as flagged.
  const auto index = [&](std::size_t b) { return static_cast<std::size_t>((*joints)[b]); };
  const RigidTransform A{convert.facing(), convert(file->bind_pose(index(0))).position};
  std::array<RigidTransform, kBoneCount> from_bind;  // joint(bind)^-1 A
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    if ((*joints)[b] != kNone) from_bind[b] = convert(file->bind_pose(index(b))).inverse() * A;
  }
  PoseCompletion completion(body ? *body : Body{});
  imported.motion.rate_hz = 1 / file->frame_time_s;
  imported.motion.poses.reserve(file->frame_count);
  for (std::size_t frame = 0; frame < file->frame_count; ++frame) {
    const auto bone = [&](std::size_t b) { return convert(file->pose(frame, index(b))) * from_bind[b]; };
    Pose pose = completion.complete(bone(0), frame == 0 ? 0 : file->frame_time_s);
    constexpr auto kTrunk = static_cast<std::size_t>(Bone::upper_trunk);
    if ((*joints)[kTrunk] != kNone) {
      // Shoulders and neck without a joint of their own go with the trunk that was found.
      pose[Bone::left_shoulder] = pose[Bone::right_shoulder] = bone(kTrunk);
      pose[Bone::neck] = completion.neck(bone(0), bone(kTrunk).rotation);
    }
    for (std::size_t b = 1; b < kBoneCount; ++b) {
      if ((*joints)[b] != kNone) pose.bones[b] = bone(b);
    }
    imported.motion.poses.push_back(pose);
  }
  if (!std::ranges::all_of(imported.motion.poses, is_valid)) return Refusal("the motion's numbers are too large");
  return imported;
}

}  // namespace hairnet
