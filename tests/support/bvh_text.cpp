#include "tests/support/bvh_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <span>

namespace hairnet {
namespace {

using Joint = DeepMimicJoint;

struct BvhJoint {
  const char* name;
  // A joint's parent is the last joint before it that is less deep.
  int depth;
  Vec3 offset;
  // The joint of the clip whose rotation this one has. Without one it is rigid with its parent.
  std::optional<Joint> turns_with;
  // The end site of a joint without children.
  std::optional<Vec3> end;
};

// Offsets in metres from DeepMimic's data/characters/humanoid3d.txt; the head's joint above the neck's is ours.
std::span<const BvhJoint> skeleton() {
  static const std::array<BvhJoint, 14> kJoints{{
      {"Hips", 0, {0, 0, 0}, Joint::root, {}},
      {"Chest", 1, {0, 0.236151, 0}, Joint::chest, {}},
      {"Neck", 2, {0, 0.223894, 0}, Joint::neck, {}},
      {"Head", 3, {0, 0.1, 0}, {}, Vec3(0, 0.18, 0)},
      {"RightArm", 2, {-0.02405, 0.2435, 0.18311}, Joint::right_shoulder, {}},
      {"RightForeArm", 3, {0, -0.274788, 0}, Joint::right_elbow, Vec3(0, -0.258947, 0)},
      {"LeftArm", 2, {-0.02405, 0.2435, -0.18311}, Joint::left_shoulder, {}},
      {"LeftForeArm", 3, {0, -0.274788, 0}, Joint::left_elbow, Vec3(0, -0.258947, 0)},
      {"RightUpLeg", 1, {0, 0, 0.084887}, Joint::right_hip, {}},
      {"RightLeg", 2, {0, -0.421546, 0}, Joint::right_knee, {}},
      {"RightFoot", 3, {0, -0.40987, 0}, Joint::right_ankle, Vec3(0.13, -0.05, 0)},
      {"LeftUpLeg", 1, {0, 0, -0.084887}, Joint::left_hip, {}},
      {"LeftLeg", 2, {0, -0.421546, 0}, Joint::left_knee, {}},
      {"LeftFoot", 3, {0, -0.40987, 0}, Joint::left_ankle, Vec3(0.13, -0.05, 0)},
  }};
  return kJoints;
}

std::string numbers(const Vec3& v) {
  char text[96];
  std::snprintf(text, sizeof text, "%.6f %.6f %.6f", v.x(), v.y(), v.z());
  return text;
}

// Returns the degrees a, b and c with rotation = Rz(a) Rx(b) Ry(c), the order of channels that the hierarchy states.
Vec3 euler_zxy_deg(const Quat& rotation) {
  const Mat3 m = rotation.toRotationMatrix();
  const double b = std::asin(std::clamp(m(2, 1), -1.0, 1.0));
  // At b = +-90 degrees only a + c or a - c is defined.
  const bool locked = std::abs(m(2, 1)) > 1 - 1e-9;
  const double a = locked ? std::atan2(m(1, 0), m(0, 0)) : std::atan2(-m(0, 1), m(1, 1));
  const double c = locked ? 0 : std::atan2(-m(2, 0), m(2, 2));
  return Vec3(a, b, c) * (180 / std::numbers::pi);
}

// Closes the braces of all joints that are deeper than `depth`.
void close_to(int depth, int open, std::string& out) {
  for (; open > depth; --open) out += std::string(static_cast<std::size_t>(open - 1), '\t') + "}\n";
}

std::string hierarchy() {
  std::string out = "HIERARCHY\n";
  int open = 0;
  for (const BvhJoint& joint : skeleton()) {
    close_to(joint.depth, open, out);
    const std::string indent(static_cast<std::size_t>(joint.depth), '\t');
    const bool is_root = joint.depth == 0;
    out += indent + (is_root ? "ROOT " : "JOINT ") + joint.name + '\n' + indent + "{\n";
    out += indent + "\tOFFSET " + numbers(joint.offset) + '\n';
    out += indent + (is_root ? "\tCHANNELS 6 Xposition Yposition Zposition" : "\tCHANNELS 3") +
           " Zrotation Xrotation Yrotation\n";
    if (joint.end) {
      out += indent + "\tEnd Site\n" + indent + "\t{\n" + indent + "\t\tOFFSET " + numbers(*joint.end) + '\n' + indent +
             "\t}\n";
    }
    open = joint.depth + 1;
  }
  close_to(0, open, out);
  return out;
}

}  // namespace

std::string bvh_text(const DeepMimicClip& clip) {
  std::string out = hierarchy();
  char head[96];
  std::snprintf(head, sizeof head, "MOTION\nFrames: %zu\nFrame Time: %.9f\n", clip.frames.size(), 1 / clip.rate_hz);
  out += head;
  for (const DeepMimicFrame& frame : clip.frames) {
    out += numbers(frame.root);
    for (const BvhJoint& joint : skeleton()) {
      const Quat rotation =
          joint.turns_with ? frame.rotations[static_cast<std::size_t>(*joint.turns_with)] : Quat::Identity();
      out += ' ' + numbers(euler_zxy_deg(rotation));
    }
    out += '\n';
  }
  return out;
}

}  // namespace hairnet
