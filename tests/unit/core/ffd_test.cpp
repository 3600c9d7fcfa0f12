#include <gtest/gtest.h>

#include <random>

#include "core/ffd/deform.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/levels.hpp"
#include "tests/unit/core/deform_cases.hpp"

namespace hairnet {
namespace {

using deform_cases::kFfdKinds;
using deform_cases::make_lattice;
using support::random_vec;

class FfdKinds : public testing::TestWithParam<support::Named<FfdKind>> {};

TEST_P(FfdKinds, reproduces_any_affine_field_inside_and_outside_the_grid) {
  const Lattice lattice = make_lattice({6, 5, 4});
  std::mt19937 random(1);
  Mat3f turn;
  for (int a = 0; a < 3; ++a) turn.col(a) = random_vec(random, 0.5f);
  const Vec3f shift = random_vec(random, 0.1f);
  std::vector<Vec3f> displacements(lattice.node_count());
  for (std::uint32_t n = 0; n < displacements.size(); ++n) displacements[n] = turn * lattice.node(n) + shift;
  std::vector<Vec3f> points;
  for (int i = 0; i < 2000; ++i) points.push_back(Vec3f(0, -0.2f, -0.1f) + random_vec(random, 0.25f));
  std::vector<Vec3f> moved(points.size());
  Deformer(lattice, points, {}, GetParam().value).deform(displacements, moved);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT((moved[i] - (points[i] + turn * points[i] + shift)).norm(), 1e-5f)
        // Points up to 0.25 m from the middle lie outside the grid too, where the extrapolation enlarges rounding
        // errors.
        << points[i].transpose();
  }
}

TEST_P(FfdKinds, is_continuous_everywhere) {
  const Lattice lattice = make_lattice({6, 5, 4});
  std::mt19937 random(2);
  std::vector<Vec3f> displacements(lattice.node_count());
  for (Vec3f& d : displacements) d = random_vec(random, 0.05f);
  std::vector<Vec3f> line;
  for (int i = 0; i <= 2000; ++i)
    line.push_back(Vec3f(-0.12f, -0.32f, -0.17f) + static_cast<float>(i) * Vec3f(1e-4f, 0.8e-4f, 0.9e-4f));
  std::vector<Vec3f> moved(line.size());
  Deformer(lattice, line, {}, GetParam().value).deform(displacements, moved);
  // Neighbours on the line are 0.16 mm apart. The random field draws them apart to less than 2 mm; a greater distance
  // would be a step between two cells.
  for (std::size_t i = 1; i < line.size(); ++i) EXPECT_LT((moved[i] - moved[i - 1]).norm(), 2e-3f) << i;
}

INSTANTIATE_TEST_SUITE_P(Both, FfdKinds, testing::ValuesIn(kFfdKinds), support::CaseName());

TEST(Ffd, quadratic_has_a_continuous_slope_also_across_the_border) {
  const Lattice lattice = make_lattice({6, 5, 4});
  std::mt19937 random(3);
  std::vector<Vec3f> displacements(lattice.node_count());
  for (Vec3f& d : displacements) d = random_vec(random, 0.05f);
  std::vector<Vec3f> line;
  for (int i = 0; i <= 400; ++i) line.push_back(Vec3f(-0.2f + 1e-3f * static_cast<float>(i), -0.21f, -0.09f));
  std::vector<Vec3f> moved(line.size());
  Deformer(lattice, line, {}, FfdKind::quadratic).deform(displacements, moved);
  for (std::size_t i = 2; i < line.size(); ++i) {
    const Vec3f bend = moved[i] - 2 * Vec3f(moved[i - 1]) + moved[i - 2];
    // A corner of the linear FFD bends ten times as much.
    EXPECT_LT(bend.norm(), 4e-4f) << "kink at point " << i;
  }
}

TEST(Ffd, linear_takes_the_nodes_value_at_a_node) {
  const Lattice lattice = make_lattice({4, 4, 4});
  std::mt19937 random(4);
  std::vector<Vec3f> displacements(lattice.node_count()), nodes(lattice.node_count()), moved(lattice.node_count());
  for (std::uint32_t n = 0; n < nodes.size(); ++n) {
    displacements[n] = random_vec(random, 0.05f);
    nodes[n] = lattice.node(n);
  }
  Deformer(lattice, nodes, {}, FfdKind::linear).deform(displacements, moved);
  for (std::size_t n = 0; n < nodes.size(); ++n) EXPECT_LT((moved[n] - nodes[n] - displacements[n]).norm(), 1e-6f);
}

TEST(Ffd, root_blend_rises_from_zero_at_the_root_by_equation_7) {
  Groom groom;
  groom.group_names = {"all"};
  const std::vector<Vec3f> strand{{0, 0, 0}, {0, -0.02f, 0}, {0.02f, -0.02f, 0}, {0.02f, -0.5f, 0}};
  groom.add_strand(strand, {.root_length_m = 0.02f});
  groom.add_strand(strand, {.root_length_m = 0.0f});
  groom.add_strand(strand, {.root_length_m = 0.02f, .rooted = false});
  const std::vector<float> blend = root_blend(groom);
  // The points lie 0, 1, 2 and more than 20 times lambda_0 from the root. The second strand has no root length and the
  // third no root, so both follow the lattice everywhere.
  EXPECT_EQ(blend[0], 0.0f);
  EXPECT_NEAR(blend[1], 1 - std::exp(-1.0), 1e-6);
  EXPECT_NEAR(blend[2], 1 - std::exp(-4.0), 1e-6);
  EXPECT_NEAR(blend[3], 1, 1e-6);
  for (std::size_t i = 4; i < 12; ++i) EXPECT_EQ(blend[i], 1.0f);
}

// Hair whose roots leave the skin looks like a wig that slips.
TEST(Ffd, a_root_stays_on_the_skull_for_any_motion_of_the_lattice) {
  const Lattice lattice = make_lattice({5, 5, 5});
  Groom groom;
  groom.group_names = {"all"};
  const std::vector<Vec3f> strand{{0, 0, 0}, {0, -0.2f, 0}};
  groom.add_strand(strand, {});
  const std::vector<Vec3f> displacements(lattice.node_count(), Vec3f(0.1f, 0, 0));
  std::vector<Vec3f> moved(2);
  Deformer(groom, lattice, FfdKind::quadratic).deform(displacements, moved);
  EXPECT_EQ(moved[0], strand[0]);
  EXPECT_NEAR(moved[1].x(), 0.1f, 1e-6);
}

TEST(Ffd, a_point_absurdly_far_away_is_still_defined) {
  const Lattice lattice = make_lattice({5, 5, 5});
  const std::vector<Vec3f> points{{1e30f, 0, 0}};
  const std::vector<Vec3f> displacements(lattice.node_count(), Vec3f::Zero());
  std::vector<Vec3f> moved(1);
  Deformer(lattice, points, {}, FfdKind::quadratic).deform(displacements, moved);
  EXPECT_TRUE(moved[0].allFinite());
}

TEST(LevelGeometry, trimmed_nodes_follow_their_combinations) {
  LevelGeometry geometry;
  geometry.lattice = make_lattice({2, 2, 2});
  geometry.active_nodes = {0, 1, 2, 3, 4, 5, 6};
  geometry.trimmed_nodes = {7};
  geometry.trimmed_begin = {0, 2};
  geometry.trimmed_from = {6, 5};
  geometry.trimmed_weights = {0.5f, 0.25f};
  ASSERT_EQ(validate(geometry), "");
  std::vector<Vec3f> active(7, Vec3f::Zero()), grid(8);
  active[6] = Vec3f(1, 0, 0);
  active[5] = Vec3f(0, 2, 0);
  expand_displacements(geometry, active, grid);
  EXPECT_EQ(grid[7], Vec3f(0.5f, 0.5f, 0));
  EXPECT_EQ(grid[6], active[6]);
}

TEST(LevelGeometry, refuses_what_does_not_fit_together) {
  LevelGeometry valid;
  valid.lattice = make_lattice({2, 2, 2});
  valid.active_nodes = {0, 1, 2, 3, 4, 5, 6};
  valid.trimmed_nodes = {7};
  valid.trimmed_begin = {0, 1};
  valid.trimmed_from = {0};
  valid.trimmed_weights = {1};
  ASSERT_EQ(validate(valid), "");
  const auto refused = [&](auto corrupt) {
    LevelGeometry geometry = valid;
    corrupt(geometry);
    return !validate(geometry).empty();
  };
  // Each line breaks one rule: sizes, finite numbers, ascending nodes, each node either active or trimmed, and
  // offsets that fit the lists.
  EXPECT_TRUE(refused([](auto& g) { g.lattice.dims[1] = 1; }));
  EXPECT_TRUE(refused([](auto& g) { g.lattice.dims[1] = 1000000; }));
  EXPECT_TRUE(refused([](auto& g) { g.lattice.spacing.x() = 0; }));
  EXPECT_TRUE(refused([](auto& g) { g.lattice.origin.z() = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](auto& g) { std::swap(g.active_nodes[0], g.active_nodes[1]); }));
  EXPECT_TRUE(refused([](auto& g) { g.trimmed_nodes[0] = 6; }));
  EXPECT_TRUE(refused([](auto& g) { g.active_nodes.pop_back(); }));
  EXPECT_TRUE(refused([](auto& g) { g.trimmed_from[0] = 7; }));
  EXPECT_TRUE(refused([](auto& g) { g.trimmed_begin = {0, 2}; }));
  EXPECT_TRUE(refused([](auto& g) { g.trimmed_begin.clear(); }));
  EXPECT_TRUE(refused([](auto& g) { g.trimmed_weights[0] = std::numeric_limits<float>::infinity(); }));
}

}  // namespace
}  // namespace hairnet
