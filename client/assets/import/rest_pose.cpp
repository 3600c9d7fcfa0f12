#include "client/assets/import/rest_pose.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <map>

namespace hairnet {
namespace {

// The smallest cosine of the angle between hips-to-head and up: a person who leans by up to 37 degrees is upright.
constexpr double kUprightCosine = 0.8;
// An upper arm or a thigh points up if its angle to up has a larger cosine. Arms of a T pose and of an A pose stay far
// below.
constexpr double kPointsUpCosine = 0.9;
// Within 15 degrees the facing is that of an axis, since no skeleton is exactly symmetric.
constexpr double kSnapCosine = 0.966;
// Heights are measured from the feet to the head joint. Within the limits a skeleton counts as a person in metres, also
// as a small child or a giant.
constexpr double kTallMin_m = 0.4, kTallMax_m = 3, kUsualTall_m = 1.45;

struct Unit {
  double m;
  const char* name;
  // A penalty for an unusual unit, which is added to the logarithm of the misfit in height.
  double rarity;
};
// CMU's library of motions counts lengths in inches over 0.45. Metres are not listed, since they are the default.
constexpr std::array<Unit, 6> kUnits{{{0.01, "a centimetre", 0},
                                      {0.001, "a millimetre", 0},
                                      {0.0254, "an inch", 0.2},
                                      {0.3048, "a foot", 0.3},
                                      {0.0254 / 0.45, "CMU's 5.64 cm", 0.3},
                                      {0.1, "a decimetre", 0.4}}};

struct Pair {
  std::size_t left, right;
};

// The names of the joint on the other side: "leftarm" -> "rightarm", "lhip" -> "rhip", "shoulderl" -> "shoulderr".
// Names have been made plain before: small letters without signs.
std::vector<std::string> names_of_other_side(const std::string& left) {
  std::vector<std::string> names;
  if (const std::size_t at = left.find("left"); at != std::string::npos)
    names.push_back(left.substr(0, at) + "right" + left.substr(at + 4));
  if (left.starts_with('l')) names.push_back('r' + left.substr(1));
  if (left.ends_with('l')) names.push_back(left.substr(0, left.size() - 1) + 'r');
  return names;
}

// Each left joint has at most one partner. The map gives the same order for every order of the file's joints.
std::vector<Pair> pairs_of(const BvhFile& file) {
  std::map<std::string, std::size_t> joints;
  for (std::size_t j = 0; j < file.joints.size(); ++j) joints.try_emplace(plain_joint_name(file.joints[j].name), j);
  std::vector<Pair> pairs;
  for (const auto& [name, left] : joints) {
    for (const std::string& other : names_of_other_side(name)) {
      const auto right = joints.find(other);
      if (right == joints.end()) continue;
      pairs.push_back({left, right->second});
      break;
    }
  }
  return pairs;
}

// The joint where trunk and legs separate: by name, else the uppermost ancestor of the head with several children.
std::size_t hips_of(const BvhFile& file, std::size_t head) {
  std::vector<int> children(file.joints.size(), 0);
  for (const BvhFile::Joint& joint : file.joints) {
    if (joint.parent >= 0) ++children[static_cast<std::size_t>(joint.parent)];
  }
  std::size_t hips = head;
  for (int j = static_cast<int>(head); j >= 0; j = file.joints[static_cast<std::size_t>(j)].parent) {
    const auto index = static_cast<std::size_t>(j);
    const std::string name = plain_joint_name(file.joints[index].name);
    if (name == "hips" || name == "hip" || name == "pelvis") return index;
    const bool is_root = file.joints[index].parent < 0;
    if (children[index] > 1 || (is_root && hips == head)) hips = index;
  }
  return hips;
}

// A skeleton in one of its poses.
class PosedSkeleton {
 public:
  PosedSkeleton(const BvhFile& file, std::size_t head, std::vector<Vec3> at)
      : file_(file), head_(head), hips_(hips_of(file, head)), at_(std::move(at)) {
    // The place where a limb leaves the trunk: the first joints of a pair with a distance between them. Every joint
    // below the first of a limb also comes in pairs. Only joints whose parents lie in one place begin a limb.
    for (const Pair& pair : pairs_of(file)) {
      const int l = file.joints[pair.left].parent, r = file.joints[pair.right].parent;
      if (l < 0 || r < 0) continue;
      const Vec3 parents = at_[static_cast<std::size_t>(l)] - at_[static_cast<std::size_t>(r)];
      if (parents.norm() <= 1e-6 * trunk().norm()) limbs_.push_back(pair);
    }
  }

  [[nodiscard]] bool has_trunk() const { return trunk().norm() > 0; }
  [[nodiscard]] bool is_upright(const Vec3& up) const {
    if (!(trunk().dot(up) >= kUprightCosine * trunk().norm())) return false;
    // Left and right must also lie beside each other, by at least a twentieth of the trunk, or they tell no facing.
    return limbs_.empty() || sideways(up).norm() > 0.05 * trunk().norm();
  }
  // The horizontal direction from right to left. Its length grows with the number of limbs; only the direction is used.
  [[nodiscard]] Vec3 sideways(const Vec3& up) const {
    Vec3 sum = Vec3::Zero();
    for (const Pair& limb : limbs_) sum += at_[limb.left] - at_[limb.right];
    return sum - sum.dot(up) * up;
  }
  // Only joints at or below the hips count, which leaves out a root on the floor. Parents precede children, so one pass
  // is enough.
  [[nodiscard]] double tall(const Vec3& up) const {
    std::vector<bool> within(at_.size(), false);
    double low = at_[hips_].dot(up), high = low;
    for (std::size_t j = hips_; j < at_.size(); ++j) {
      const int parent = file_.joints[j].parent;
      within[j] = j == hips_ || (parent >= 0 && within[static_cast<std::size_t>(parent)]);
      if (!within[j]) continue;
      low = std::min(low, at_[j].dot(up));
      high = std::max(high, at_[j].dot(up));
    }
    return high - low;
  }

  // Whether an upper arm or a thigh points up, as in a zero pose with all bones along one axis.
  [[nodiscard]] bool limb_points(const Vec3& up) const {
    return std::ranges::any_of(limbs_, [&](const Pair& limb) {
      const auto child = std::ranges::find(file_.joints, static_cast<int>(limb.left), &BvhFile::Joint::parent);
      if (child == file_.joints.end()) return false;
      const Vec3 bone = at_[static_cast<std::size_t>(child - file_.joints.begin())] - at_[limb.left];
      return bone.dot(up) > kPointsUpCosine * bone.norm();
    });
  }

 private:
  [[nodiscard]] Vec3 trunk() const { return at_[head_] - at_[hips_]; }

  const BvhFile& file_;
  std::size_t head_, hips_;
  std::vector<Vec3> at_;
  std::vector<Pair> limbs_;
};

std::string name_of(const Vec3& axis) {
  for (int i = 0; i < 3; ++i) {
    if (std::abs(axis[i]) > 0.999) return std::string(axis[i] > 0 ? "+" : "-") + "xyz"[i];
  }
  char text[64];
  std::snprintf(text, sizeof text, "(%.2f, %.2f, %.2f)", axis.x(), axis.y(), axis.z());
  return text;
}

// The axis is kept exact where the facing is near it, so files in usual axes are not turned by a fraction of a degree.
Vec3 snapped(const Vec3& level) {
  int axis = 0;
  level.cwiseAbs().maxCoeff(&axis);
  const Vec3 nearest = level[axis] > 0 ? Vec3::Unit(axis) : Vec3(-Vec3::Unit(axis));
  return level.dot(nearest) > kSnapCosine ? nearest : level;
}

// +z if that is horizontal, else -y, which is how programs convert one to the other.
Vec3 usual_face(const Vec3& up) {
  return std::abs(up.z()) < 0.5 ? Vec3::UnitZ() : Vec3(-Vec3::UnitY());
}

// The unit that gives a person for that many file units; none when no usual unit does. Among the units that fit, the
// one with the smallest sum of misfit and rarity wins.
const Unit* usual_unit(double tall) {
  // The logarithm of the height may differ from the usual one by this much: people have 0.72 to 2.9 m.
  constexpr double kSlack = 0.7;
  const Unit* best = nullptr;
  double best_misfit = 0;
  for (const Unit& unit : kUnits) {
    const double off = std::abs(std::log(tall * unit.m / kUsualTall_m));
    if (!(off < kSlack) || (best && off + unit.rarity >= best_misfit)) continue;
    best = &unit;
    best_misfit = off + unit.rarity;
  }
  return best;
}

// A usual unit is taken, never one that is fitted to the height, so a tall person stays tall.
double unit_of(double tall, const std::optional<double>& given_m, std::vector<std::string>& warnings) {
  // Metres need no warning, and neither does a given unit with which the skeleton has a person's size.
  const double tall_m = tall * given_m.value_or(1);
  if (tall_m >= kTallMin_m && tall_m <= kTallMax_m) return given_m.value_or(1);
  const Unit* usual = usual_unit(tall);
  char text[160];
  if (usual && !given_m) {
    std::snprintf(text, sizeof text, "the skeleton is %.3g units tall, so a unit is taken as %s; --unit sets it", tall,
                  usual->name);
    warnings.emplace_back(text);
    return usual->m;
  }
  // The hint is the unit in which the skeleton has a usual height.
  const double hint_m = usual ? usual->m : tall > 0 ? kUsualTall_m / tall : 1;
  std::snprintf(text, sizeof text, "the skeleton is %.3g m tall; --unit %.3g would make it a person", tall_m, hint_m);
  warnings.emplace_back(text);
  return given_m.value_or(1);
}

// The upright pose, and its up axis.
struct Choice {
  bool is_first_frame;
  Vec3 up;
};

Result<Choice> choose(const PosedSkeleton& zero, const PosedSkeleton& first, const BvhImport& import,
                      std::vector<std::string>& warnings) {
  const Vec3 y = import.up ? direction(*import.up) : Vec3::UnitY();
  const bool may_be_z = !import.up && !(import.face && parallel(*import.face, Axis::plus_z));
  // A zero pose along z may be a person who lies down. It counts as up only if the person is upright along z in motion
  // too.
  const bool is_z = may_be_z && !zero.is_upright(y) && !first.is_upright(y) && first.is_upright(Vec3::UnitZ());
  const Vec3 up = is_z ? Vec3::UnitZ() : y;
  if (is_z) warnings.emplace_back("+z is taken as up, since the head is above the hips along it; --up sets it");
  if (import.rest != RestPose::automatic) {
    const bool is_first = import.rest == RestPose::first;
    if (!(is_first ? first : zero).is_upright(up))
      warnings.emplace_back("the head is not upright above the hips in the pose that --rest names");
    return Choice{is_first, up};
  }
  // Skeletons whose joints all lie in one place at zero have no trunk that could speak against it.
  const bool is_zero_upright = zero.is_upright(up) || !zero.has_trunk();
  // A zero pose with a limb that points up is an artefact of the exporter, if the first frame is upright.
  if (is_zero_upright && (!zero.limb_points(up) || !first.is_upright(up))) return Choice{false, up};
  if (!first.is_upright(up))
    return Refusal(
        "the skeleton is upright neither in the zero pose nor in the first frame: name the pose with --rest " +
        std::string("zero or --rest first (rest= of a character), or the axis that is up with --up"));
  warnings.emplace_back("the zero pose is not upright: the first frame is taken as the rest pose; --rest sets it");
  return Choice{true, up};
}

}  // namespace

std::string plain_joint_name(std::string_view name) {
  name.remove_prefix(name.find_last_of(':') + 1);  // npos + 1 = 0
  std::string out;
  for (const unsigned char letter : name) {
    // Letters beyond ASCII keep their bytes: they tell names of other scripts apart.
    if (letter >= 0x80 || std::isalnum(letter)) out += static_cast<char>(letter < 0x80 ? std::tolower(letter) : letter);
  }
  return out;
}

Result<SkeletonRest> find_rest(const BvhFile& file, std::size_t head, const BvhImport& import,
                               std::vector<std::string>& warnings) {
  const PosedSkeleton zero(file, head, file.zero_positions()), first(file, head, file.positions(0));
  const Result<Choice> chosen = choose(zero, first, import, warnings);
  if (!chosen) return Refusal(chosen.error());
  const PosedSkeleton& skeleton = chosen->is_first_frame ? first : zero;

  SkeletonRest rest{chosen->is_first_frame, chosen->up, usual_face(chosen->up), 1};
  // The left-hand side crossed with up is the direction of the face.
  const Vec3 seen = skeleton.sideways(rest.up).cross(rest.up);
  if (import.face) {
    rest.face = direction(*import.face);
  } else if (seen.norm() > 0 && seen.allFinite()) {
    rest.face = seen.normalized();
    // The first frame is a person in motion, who may really look 10 degrees aside; only a zero pose is snapped.
    if (!rest.is_first_frame) rest.face = snapped(rest.face);
    if (!rest.is_first_frame && rest.face != Vec3::UnitZ())
      warnings.push_back("the rest pose faces " + name_of(rest.face) + ", by its left and right; --face sets it");
  } else if (rest.is_first_frame) {
    warnings.push_back("no left and right joints tell where it faces: " + name_of(rest.face) +
                       " is taken; --face sets it");
  }

  rest.unit_m = unit_of(skeleton.tall(rest.up), import.unit_m, warnings);
  return rest;
}

}  // namespace hairnet
