#include <algorithm>
#include <cmath>
#include <utility>

#include "client/assets/import/imported_body.hpp"

namespace hairnet {
namespace {

bool is_small(char c) {
  return c >= 'a' && c <= 'z';
}
bool is_capital(char c) {
  return c >= 'A' && c <= 'Z';
}

// The words of a name in small letters: "left", "shoulder" of LeftShoulder. Digits and signs divide words. Only ASCII
// letters count, so names in other scripts have no words and no bone. The length is bounded because it comes from a
// file.
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words;
  char before = ' ';
  for (const char c : name.substr(0, 100)) {
    const bool is_letter = is_small(c) || is_capital(c), follows = is_small(before) || is_capital(before);
    if (is_letter && (!follows || (is_capital(c) && is_small(before)))) words.emplace_back();
    if (is_letter) words.back().push_back(is_capital(c) ? static_cast<char>(c - 'A' + 'a') : c);
    before = c;
  }
  return words;
}

// Words that programs put before or behind the names of all their joints, so that they say nothing about one joint.
// What is left of mixamorig:LeftShoulder is "left" and "shoulder".
constexpr std::array<std::string_view, 18> kOfAllJoints{"mixamorig", "j",        "bip", "biped", "valve", "c",
                                                        "def",       "org",      "cc",  "base",  "b",     "rig",
                                                        "bone",      "armature", "jnt", "joint", "bind",  "skeleton"};

}  // namespace

// Exactly one or two words must be left: HeadTop_End and LeftShoulderTwist are other joints, which lie elsewhere.
std::optional<Bone> bone_of_joint(std::string_view name) {
  std::vector<std::string> words = words_of(name);
  std::erase_if(words,
                [](const std::string& word) { return std::ranges::find(kOfAllJoints, word) != kOfAllJoints.end(); });
  if (words.size() == 1 && words[0] == "head") return Bone::head;
  if (words.size() == 1 && words[0] == "neck") return Bone::neck;
  if (words.size() != 2) return {};
  // Both orders occur: LeftShoulder, and shoulder_L.
  if (words[1] == "l" || words[1] == "r" || words[1] == "left" || words[1] == "right") std::swap(words[0], words[1]);
  if (words[1] != "shoulder" && words[1] != "clavicle" && words[1] != "collar") return {};
  if (words[0] == "l" || words[0] == "left") return Bone::left_shoulder;
  if (words[0] == "r" || words[0] == "right") return Bone::right_shoulder;
  return {};
}

void ImportedBody::add_joint(Bone bone, std::string_view name, const Vec3& position) {
  std::optional<Joint>& joint = joints[static_cast<std::size_t>(bone)];
  if (!joint && position.allFinite()) joint = Joint{std::string(name), position};
}

void ImportedBody::state_joints() {
  const auto joint = [&](Bone bone) { return joints[static_cast<std::size_t>(bone)]; };
  if (joint(Bone::head)) states.origin = joint(Bone::head)->position;
  // Without an axis upwards the shoulders do not tell front from back.
  if (!states.up || !joint(Bone::left_shoulder) || !joint(Bone::right_shoulder)) return;
  // The face looks where a person looks whose left shoulder is on this side.
  const Vec3 left = joint(Bone::left_shoulder)->position - joint(Bone::right_shoulder)->position;
  const Vec3 forward = left.cross(direction(*states.up));
  for (const Axis axis : {Axis::plus_x, Axis::minus_x, Axis::plus_y, Axis::minus_y, Axis::plus_z, Axis::minus_z}) {
    // A skeleton that faces no axis, as one in a turned pose, states no face; the face is then guessed from the mesh.
    // kAlong is the cosine of the largest angle to the axis, some 26 degrees.
    constexpr double kAlong = 0.9;
    if (forward.dot(direction(axis)) > kAlong * forward.norm()) states.face = axis;
  }
}

}  // namespace hairnet
