#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "core/levels/build.hpp"
#include "tests/support/build_grooms.hpp"

namespace hairnet {
namespace {

// Returns the low level of a groom with all odd strands and a body, built once. Each test corrupts a copy.
const Level& valid_level() {
  static const auto level = [] {
    Groom groom = support::make_odd_groom();
    groom.body = support::make_plain_body();
    return build_level(groom, kLevelSpecs[2]);
  }();
  return *level;
}

TEST(ValidateLevel, built_levels_are_valid) {
  Groom groom = support::make_odd_groom();
  for (const Body& body : {Body{}, support::make_plain_body()}) {
    groom.body = body;
    const auto set = build_levels(groom);
    for (const Level& level : set->levels) EXPECT_EQ(validate(level), "");
  }
}

// Gives the level a skin of its own, since levels share theirs, and returns its first field.
SkinDistanceField& skin_of(Level& level) {
  auto own = std::make_shared<Skin>(*level.skin);
  level.skin = own;
  return own->front();
}

struct Corruption {
  const char* name;
  std::function<void(Level&)> corrupt;
};

TEST(ValidateLevel, refuses_what_no_solver_may_run) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinite = std::numeric_limits<float>::infinity();
  // Levels are also read from files. A solver that ran one of these would read beyond arrays, or compute NaN.
  const std::vector<Corruption> corruptions{
      {"no lattice", [](Level& l) { l.geometry.lattice.dims[1] = 0; }},
      // The low level has 5 x 5 x 5 nodes, so 124 is the last one.
      {"an active node beyond the grid", [](Level& l) { l.geometry.active_nodes.back() = 125; }},
      {"no bound", [](Level& l) { l.displacement_max_m = kNan; }},
      {"a node elsewhere", [](Level& l) { l.rest[3][1] += 1e-3f; }},
      {"a node nowhere", [](Level& l) { l.rest[3][1] = kNan; }},
      {"rest too short", [](Level& l) { l.rest.pop_back(); }},
      {"mass too short", [](Level& l) { l.mass.pop_back(); }},
      {"no mass", [](Level& l) { l.mass[0] = 0; }},
      {"infinite mass", [](Level& l) { l.mass[0] = kInfinite; }},
      {"negative ether", [](Level& l) { l.ether_stiffness[0] = -1; }},
      {"ether damping that is no number", [](Level& l) { l.ether_damping[0] = kNan; }},
      {"drag too long", [](Level& l) { l.drag.emplace_back(); }},
      // The numbers are a drag matrix in the order xx, xy, xz, yy, yz, zz. With xy^2 > xx yy it is not positive
      // semi-definite, and air would speed hair up.
      {"drag that pushes", [](Level& l) { l.drag[0] = {1, 2, 0, 1, 0, 1}; }},
      {"drag that is no number", [](Level& l) { l.drag[0][5] = kNan; }},
      {"no first offset", [](Level& l) { l.springs.begin.clear(); }},
      {"a first offset that is not 0", [](Level& l) { l.springs.begin[0] = 1; }},
      {"an offset beyond the entries", [](Level& l) { l.springs.begin[1] = 1u << 30; }},
      {"a last offset beyond the entries", [](Level& l) { ++l.attachments.begin.back(); }},
      {"offsets that descend", [](Level& l) { std::swap(l.springs.begin[1], l.springs.begin[2]); }},
      {"a node that does not exist", [](Level& l) { l.springs.nodes.back() = 60000; }},
      {"nodes that do not ascend", [](Level& l) { l.springs.nodes[1] = l.springs.nodes[0]; }},
      {"weights of another sum", [](Level& l) { l.springs.weights[0] += 0.01f; }},
      {"an attachment's weights of another sum", [](Level& l) { l.attachments.weights[0] += 0.01f; }},
      {"a weight that is no number", [](Level& l) { l.attachments.weights[0] = kNan; }},
      {"weights too short", [](Level& l) { l.springs.weights.pop_back(); }},
      {"no stiffness", [](Level& l) { l.springs.stiffness[0] = 0; }},
      {"infinite stiffness", [](Level& l) { l.attachments.stiffness[0] = kInfinite; }},
      {"negative damping", [](Level& l) { l.springs.damping[0] = -1; }},
      {"another rest", [](Level& l) { l.springs.rest[0][0] += 0.01f; }},
      {"a rest that is no number", [](Level& l) { l.attachments.rest[0][2] = kNan; }},
      {"rests too short", [](Level& l) { l.springs.rest.pop_back(); }},
      {"no skin", [](Level& l) { l.skin = nullptr; }},
      {"no such bone", [](Level& l) { skin_of(l).bone = static_cast<Bone>(kBoneCount); }},
      {"skin of no size", [](Level& l) { skin_of(l).cell_m = 0; }},
      {"a skin's origin that is no number", [](Level& l) { skin_of(l).origin[0] = kNan; }},
      {"a distance too few", [](Level& l) { skin_of(l).distance.pop_back(); }},
      {"a distance that is no number", [](Level& l) { skin_of(l).distance[0] = kNan; }},
      {"a grid without cells", [](Level& l) { skin_of(l).dims[0] = 1; }},
      {"a contact's node that does not exist", [](Level& l) { l.contacts.nodes[0] = 60000; }},
      {"contact weights of more than 1", [](Level& l) { l.contacts.weights[0] = 1.5f; }},
      {"a limit too few", [](Level& l) { l.contacts.limit.pop_back(); }},
      {"a contact point that is no number", [](Level& l) { l.contacts.rest[0][1] = kNan; }},
      {"contact offsets that descend", [](Level& l) { std::swap(l.contacts.begin[1], l.contacts.begin[2]); }},
      {"a negative potential", [](Level& l) { l.contacts.potential[0] = -1; }},
  };
  ASSERT_GT(valid_level().contacts.count(), 2u);
  for (const Corruption& corruption : corruptions) {
    Level level = valid_level();
    ASSERT_EQ(validate(level), "");
    corruption.corrupt(level);
    const std::string error = validate(level);
    EXPECT_NE(error, "") << corruption.name;
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
}

TEST(ValidateLevel, refuses_a_level_without_nodes) {
  EXPECT_NE(validate(Level{}), "");
}

TEST(ValidateLevel, refuses_a_lattice_too_small_for_quadratic_ffd) {
  Level level = valid_level();
  level.geometry = {};
  level.geometry.lattice.dims = {2, 3, 3};
  for (std::uint32_t node = 0; node < level.geometry.lattice.node_count(); ++node)
    level.geometry.active_nodes.push_back(node);
  level.geometry.trimmed_begin = {0};
  ASSERT_EQ(validate(level.geometry), "");
  EXPECT_EQ(validate(level), "lattice: fewer than the 3 nodes an axis of quadratic FFD");
}

TEST(ValidateLevel, refuses_more_stiffeners_than_have_an_index) {
  Level level = valid_level();
  Stiffeners& springs = level.springs;
  // Stiffeners are named by indices of 16 bits. The first spring is repeated until there are 65 536.
  while (springs.count() <= std::numeric_limits<std::uint16_t>::max()) {
    for (std::uint32_t e = 0; e < springs.begin[1]; ++e) {
      springs.nodes.push_back(std::uint16_t{springs.nodes[e]});
      springs.weights.push_back(float{springs.weights[e]});
    }
    springs.begin.push_back(static_cast<std::uint32_t>(springs.nodes.size()));
    springs.stiffness.push_back(springs.stiffness[0]);
    springs.damping.push_back(springs.damping[0]);
    springs.rest.push_back(Vec3f(springs.rest[0]));
  }
  EXPECT_EQ(validate(level), "stiffeners: more than have an index");
}

}  // namespace
}  // namespace hairnet
