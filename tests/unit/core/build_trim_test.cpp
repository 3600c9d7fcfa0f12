#include "core/levels/trim.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/levels/fit_lattice.hpp"
#include "core/levels/lumped_hair.hpp"
#include "core/levels/resample.hpp"
#include "tests/support/build_grooms.hpp"

namespace hairnet {
namespace {

Lattice unit_lattice(int n) {
  Lattice lattice;
  lattice.dims = {n, n, n};
  return lattice;
}

// Returns the grid's nodes from `low` to `high` as active ones, both corners included.
std::vector<bool> box_of(const Lattice& lattice, const std::array<int, 3>& low, const std::array<int, 3>& high) {
  std::vector<bool> active(lattice.node_count());
  for (std::uint32_t node = 0; node < lattice.node_count(); ++node) {
    const auto at = lattice.coordinates(node);
    active[node] = true;
    for (int axis = 0; axis < 3; ++axis) {
      if (at[axis] < low[axis] || at[axis] > high[axis]) active[node] = false;
    }
  }
  return active;
}

LevelGeometry trim_groom(const Groom& groom, int n) {
  const Grid grid(fit_lattice(groom.points, {n, n, n}));
  LumpedHair lumped(grid.node_count());
  std::vector<Vec3> polyline;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    polyline_on_grid(grid, groom.strand_points(s), polyline);
    lump_strand(grid, polyline, groom.strands[s], {}, lumped);
  }
  return trim(grid.lattice(), lumped.touched);
}

// Describes the weights by which a trimmed node follows active ones: their sum, the sum of their sizes, and their
// number.
struct Combination {
  double sum = 0, amplification = 0;
  std::size_t count = 0;
};

Combination combination_of(const LevelGeometry& geometry, std::size_t t) {
  Combination c;
  for (std::uint32_t e = geometry.trimmed_begin[t]; e < geometry.trimmed_begin[t + 1]; ++e) {
    c.sum += static_cast<double>(geometry.trimmed_weights[e]);
    c.amplification += std::abs(static_cast<double>(geometry.trimmed_weights[e]));
    ++c.count;
  }
  return c;
}

// Returns the distance to the nearest active node in cells, along the axis where it is largest.
int nodes_to_nearest_active(const LevelGeometry& geometry, std::uint32_t node) {
  const auto at = geometry.lattice.coordinates(node);
  int nearest = 1000;
  for (const std::uint32_t active : geometry.active_nodes) {
    const auto to = geometry.lattice.coordinates(active);
    nearest = std::min(nearest, std::max({std::abs(at[0] - to[0]), std::abs(at[1] - to[1]), std::abs(at[2] - to[2])}));
  }
  return nearest;
}

Vec3f affine(const Vec3f& x) {
  return Vec3f(0.3f, -0.2f, 0.1f) + Vec3f(0.5f * x.y(), x.x() - x.z(), 0.2f * x.z() + x.y());
}

std::vector<Vec3f> expand(const LevelGeometry& geometry, Vec3f (*field)(const Vec3f&)) {
  std::vector<Vec3f> active, grid(geometry.lattice.node_count());
  for (const std::uint32_t node : geometry.active_nodes) active.push_back(field(geometry.lattice.node(node)));
  expand_displacements(geometry, active, grid);
  return grid;
}

TEST(Trim, active_and_trimmed_nodes_are_the_whole_grid_for_odd_grooms) {
  const Groom groom = support::make_odd_groom();
  for (const int n : {3, 4, 5, 7, 10, 13}) {
    const LevelGeometry geometry = trim_groom(groom, n);
    EXPECT_EQ(validate(geometry), "");
    EXPECT_EQ(geometry.active_nodes.size() + geometry.trimmed_nodes.size(), geometry.lattice.node_count());
  }
}

TEST(Trim, every_combination_is_bounded_and_near) {
  for (const int n : {4, 7, 10}) {
    const LevelGeometry geometry = trim_groom(support::make_odd_groom(), n);
    for (std::size_t t = 0; t < geometry.trimmed_nodes.size(); ++t) {
      const Combination c = combination_of(geometry, t);
      EXPECT_LE(c.amplification, kAmplificationMax + 1e-5);
      EXPECT_LE(c.sum, 1 + 1e-5);
      // A combination takes the nearest 8, 16 or at most 32 nodes (combination() in trim.cpp).
      EXPECT_LE(c.count, 32u);
      EXPECT_EQ(c.count == 0, nodes_to_nearest_active(geometry, geometry.trimmed_nodes[t]) > kTrimReach);
    }
  }
}

TEST(Trim, a_translation_carries_nodes_beside_hair_along) {
  const LevelGeometry geometry = trim_groom(support::make_head_of_hair(300), 10);
  const std::vector<Vec3f> grid = expand(geometry, [](const Vec3f&) { return Vec3f(1, 2, 3); });
  for (const std::uint32_t node : geometry.trimmed_nodes) {
    if (nodes_to_nearest_active(geometry, node) > 1) continue;
    EXPECT_NEAR((grid[node] - Vec3f(1, 2, 3)).norm(), 0, 1e-4f);
  }
}

// The active nodes form a slab of 5 x 3 x 5. The nodes beside its two large faces, but for the rim, must continue an
// affine field exactly: 3 x 3 nodes on either side.
TEST(Trim, an_affine_field_continues_beside_a_slab_of_cells) {
  const Lattice lattice = unit_lattice(9);
  const LevelGeometry geometry = trim(lattice, box_of(lattice, {2, 3, 2}, {6, 5, 6}));
  const std::vector<Vec3f> grid = expand(geometry, affine);
  std::size_t beside_faces = 0;
  for (std::uint32_t node = 0; node < lattice.node_count(); ++node) {
    const auto [i, j, k] = lattice.coordinates(node);
    const bool is_beside_a_face = i >= 3 && i <= 5 && k >= 3 && k <= 5 && (j == 2 || j == 6);
    if (!is_beside_a_face) continue;
    ++beside_faces;
    EXPECT_NEAR((grid[node] - affine(lattice.node(node))).norm(), 0, 1e-4f) << i << ' ' << j << ' ' << k;
  }
  EXPECT_EQ(beside_faces, 18u);
}

// An affine field is a stretched and sheared lattice, the smoothest motion that hair has. Where weights are bounded,
// it may be off, but for less than half of the nodes.
TEST(Trim, an_affine_field_continues_wherever_no_weight_is_bounded) {
  const LevelGeometry geometry = trim_groom(support::make_head_of_hair(300), 10);
  const std::vector<Vec3f> grid = expand(geometry, affine);
  std::size_t exact = 0, all = 0;
  for (std::size_t t = 0; t < geometry.trimmed_nodes.size(); ++t) {
    const std::uint32_t node = geometry.trimmed_nodes[t];
    const Combination c = combination_of(geometry, t);
    if (c.count == 0) continue;
    ++all;
    const float error = (grid[node] - affine(geometry.lattice.node(node))).norm();
    if (c.sum > 1 - 1e-4 && c.amplification < kAmplificationMax - 1e-3) {
      EXPECT_LT(error, 1e-4f);
    }
    if (error < 1e-4f) ++exact;
  }
  EXPECT_GT(exact, all / 2);
}

// Nodes of one plane say nothing about the direction across it, so the field cannot be continued. It must fade out in
// steps of a third, and not end at once.
TEST(Trim, nodes_in_one_plane_fade_to_zero) {
  const Lattice lattice = unit_lattice(9);
  const LevelGeometry geometry = trim(lattice, box_of(lattice, {0, 4, 0}, {8, 4, 8}));
  const std::vector<Vec3f> grid = expand(geometry, [](const Vec3f&) { return Vec3f(1, 0, 0); });
  const float expected[] = {0, 0, 1 / 3.0f, 2 / 3.0f, 1, 2 / 3.0f, 1 / 3.0f, 0, 0};
  for (int j = 0; j < 9; ++j) EXPECT_NEAR(grid[lattice.index(4, j, 4)].x(), expected[j], 1e-5f);
}

TEST(Trim, few_active_nodes_give_a_mean) {
  const Lattice lattice = unit_lattice(5);
  for (int count = 1; count <= 4; ++count) {
    const LevelGeometry geometry = trim(lattice, box_of(lattice, {1, 1, 1}, {count, 1, 1}));
    EXPECT_EQ(validate(geometry), "");
    const std::vector<Vec3f> grid = expand(geometry, [](const Vec3f&) { return Vec3f(0, 1, 0); });
    EXPECT_NEAR(grid[lattice.index(1, 2, 1)].y(), 2 / 3.0f, 1e-5f);
  }
}

TEST(Trim, four_nodes_that_span_space_are_enough_for_a_bounded_fit) {
  const Lattice lattice = unit_lattice(5);
  std::vector<bool> active(lattice.node_count());
  for (const std::array<int, 3>& at : {std::array{2, 2, 2}, {3, 2, 2}, {2, 3, 2}, {2, 2, 3}}) {
    active[lattice.index(at[0], at[1], at[2])] = true;
  }
  const LevelGeometry geometry = trim(lattice, active);
  const std::vector<Vec3f> grid = expand(geometry, affine);
  // An affine field has here the value at (3,2,2), plus that at (2,3,2), less that at (2,2,2).
  const std::uint32_t beside = lattice.index(3, 3, 2);
  EXPECT_NEAR((grid[beside] - affine(lattice.node(beside))).norm(), 0, 1e-4f);
}

TEST(Trim, a_whole_active_grid_has_nothing_to_combine) {
  const Lattice lattice = unit_lattice(4);
  const LevelGeometry geometry = trim(lattice, std::vector<bool>(lattice.node_count(), true));
  EXPECT_EQ(geometry.active_nodes.size(), 64u);
  EXPECT_TRUE(geometry.trimmed_from.empty());
  EXPECT_EQ(validate(geometry), "");
}

TEST(Trim, a_grid_without_hair_stays_at_rest) {
  const Lattice lattice = unit_lattice(4);
  const LevelGeometry geometry = trim(lattice, std::vector<bool>(lattice.node_count(), false));
  EXPECT_EQ(validate(geometry), "");
  for (const Vec3f& d : expand(geometry, affine)) EXPECT_EQ(d, Vec3f(Vec3f::Zero()));
}

}  // namespace
}  // namespace hairnet
