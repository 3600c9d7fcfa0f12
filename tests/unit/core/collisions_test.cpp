#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numbers>

#include "client/assets/made/made.hpp"
#include "core/ffd/deform.hpp"
#include "core/geometry/mesh_query.hpp"
#include "core/levels/build.hpp"
#include "core/world/world.hpp"

// Tests hair against the body as a character of a world meets it: long hair on our own bust.
namespace hairnet {
namespace {

constexpr int kTicksPerSecond = 30;
// A point of a strand counts as too deep when it lies 3 mm deeper in the body than in the design.
constexpr double kTooDeep_m = 0.003;

const Groom& long_hair() {
  static const Groom groom = [] {
    HairstyleOptions options;
    options.strand_count = 1500;
    return *make_hairstyle("long_straight", options);
  }();
  return groom;
}

std::shared_ptr<const LevelSet> levels(bool contact) {
  auto set = std::make_shared<LevelSet>();
  set->levels[0] = *build_level(long_hair(), kLevelSpecs[0]);
  if (!contact) set->levels[0].contacts = {};
  return set;
}

class Character {
 public:
  explicit Character(bool contact) : world_({}), id_(world_.add({levels(contact), LevelIndex::high, {}})) {}

  // Eases from its pose to `pose` in `ease_s`, then stays still for `hold_s`.
  void go_to(const Pose& pose, double ease_s, double hold_s) {
    const auto ease = static_cast<int>(ease_s * kTicksPerSecond), hold = static_cast<int>(hold_s * kTicksPerSecond);
    for (int tick = 1; tick <= ease + hold; ++tick) {
      world_.set_pose(id_, interpolate(pose_, pose, std::min(1.0, static_cast<double>(tick) / ease)));
      world_.step();
    }
    pose_ = pose;
  }

  [[nodiscard]] const Level& level() const { return *world_.lattice(id_).model; }
  [[nodiscard]] std::span<const Vec3f> displacement() const { return world_.lattice(id_).displacement; }
  [[nodiscard]] double farthest_m() const {
    double farthest = 0;
    for (const Vec3f& d : displacement()) farthest = std::max(farthest, static_cast<double>(d.norm()));
    return farthest;
  }

  // Returns the share of strand points that lie too deep. The body is bent into the pose first, in head space.
  [[nodiscard]] double share_too_deep() const {
    const Groom& groom = long_hair();
    std::vector<Vec3f> grid(level().geometry.lattice.node_count()), points(groom.points.size());
    expand_displacements(level().geometry, displacement(), grid);
    Deformer(groom, level().geometry.lattice, FfdKind::quadratic).deform(grid, points);
    Pose in_head;
    for (std::size_t b = 0; b < kBoneCount; ++b) in_head.bones[b] = pose_.head().inverse() * pose_.bones[b];
    TriangleMesh bent = groom.body.mesh;
    skin_vertices(groom.body, in_head, bent.vertices);
    const MeshQuery body(bent), body_in_design(groom.body.mesh);
    std::size_t count = 0;
    for (std::size_t p = 0; p < points.size(); ++p)
      if (depth(body, points[p]) > depth(body_in_design, groom.points[p]) + kTooDeep_m) ++count;
    return static_cast<double>(count) / static_cast<double>(points.size());
  }

 private:
  static double depth(const MeshQuery& body, const Vec3f& point) {
    const Vec3 p = point.cast<double>();
    return body.inside(p) ? body.closest(p).distance : 0;
  }

  World world_;
  CharacterId id_;
  Pose pose_;
};

RigidTransform about(const Vec3f& joint, const Quat& rotation) {
  const Vec3 j = joint.cast<double>();
  return {rotation, j - rotation * j};
}

Pose head_turned(double yaw) {
  const Body& body = long_hair().body;
  const auto turn = [&](Bone bone, double angle) {
    return about(body.joints[static_cast<std::size_t>(bone)], Quat(Eigen::AngleAxisd(angle, Vec3::UnitY())));
  };
  Pose pose;
  pose[Bone::neck] = turn(Bone::neck, yaw / 2);
  pose[Bone::head] = pose[Bone::neck] * turn(Bone::head, yaw / 2);
  return pose;
}

Pose shoulders_raised(double height_m) {
  Pose pose;
  pose[Bone::left_shoulder].position.y() = height_m;
  pose[Bone::right_shoulder].position.y() = height_m;
  return pose;
}

// The head turns by 60 degrees, so long hair is swept into a shoulder. Contact must spare three quarters of the points
// that are too deep without it.
TEST(Collisions, hair_meets_the_shoulders_when_the_head_turns) {
  const Pose turned = head_turned(std::numbers::pi / 3);
  Character with(true), without(false);
  with.go_to(turned, 0.7, 0.8);
  without.go_to(turned, 0.7, 0.8);
  // Without contact the shoulder must meet some hair, or the comparison says nothing.
  EXPECT_GT(without.share_too_deep(), 0.03);
  EXPECT_LT(with.share_too_deep(), 0.25 * without.share_too_deep());
}

// A shrug lifts the hair that lies on the shoulders. When they sink again, the hair must come down to its design and
// not stay on them.
TEST(Collisions, shoulders_that_rise_push_hair_up_and_it_comes_back) {
  Character character(true);
  character.go_to(shoulders_raised(0.04), 0.4, 0.4);
  double up = 0;
  std::size_t pushed = 0;
  for (const Vec3f& d : character.displacement()) {
    up += static_cast<double>(d.y());
    if (d.y() > 0.01f) ++pushed;
  }
  EXPECT_GT(up, 0);
  EXPECT_GT(pushed, 10u);
  EXPECT_GT(character.farthest_m(), 0.015);
  character.go_to({}, 0.4, 4);
  EXPECT_LT(character.farthest_m(), 0.002);
}

// The same shrug moves nothing without contact, so it is contact that pushes hair in the case above.
TEST(Collisions, without_contact_the_shoulders_move_nothing) {
  Character character(false);
  character.go_to(shoulders_raised(0.04), 0.4, 0.4);
  EXPECT_LT(character.farthest_m(), 1e-5);
}

// The bones keep their places relative to each other, so contact has no reason to act.
TEST(Collisions, a_body_that_moves_as_one_pushes_nothing) {
  Character character(true);
  character.go_to(rigid_pose({Quat::Identity(), Vec3(0, 0, 1e-9)}), 0.1, 1);
  EXPECT_LT(character.farthest_m(), 1e-5);
}

}  // namespace
}  // namespace hairnet
