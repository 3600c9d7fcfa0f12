#include "core/levels/ether.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/levels/fit_lattice.hpp"
#include "core/levels/resample.hpp"
#include "core/levels/trim.hpp"
#include "tests/support/build_grooms.hpp"

namespace hairnet {
namespace {

constexpr double kGravity = 9.81;

// All stages of the build of an ether from a groom: the grid, the hair's shares of its nodes, the trimmed grid, and
// the mechanics of the nodes.
struct Filled {
  Grid grid;
  LumpedHair lumped;
  LevelGeometry geometry;
  NodeMechanics nodes;
};

Filled fill(const Groom& groom, int n) {
  const Grid grid(fit_lattice(groom.points, {n, n, n}));
  LumpedHair lumped(grid.node_count());
  std::vector<Vec3> polyline;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    polyline_on_grid(grid, groom.strand_points(s), polyline);
    lump_strand(grid, polyline, groom.strands[s], groom.materials.of(groom.strands[s].group), lumped);
  }
  LevelGeometry geometry = trim(grid.lattice(), lumped.touched);
  NodeMechanics nodes = fill_ether(geometry, lumped);
  return {grid, std::move(lumped), std::move(geometry), std::move(nodes)};
}

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

// Makes 30 straight strands that hang 30 cm from roots at the same height.
Groom make_curtain() {
  Groom groom;
  for (int s = 0; s < 30; ++s) {
    const Vec3f root(0.01f * static_cast<float>(s % 6), 0.1f, 0.02f * static_cast<float>(s / 6));
    support::add(groom, support::straight(root, {0, -1, 0}, 0.3f, 12));
  }
  return groom;
}

TEST(Ether, total_mass_is_the_hairs_and_half_as_much_again_at_every_level) {
  const Groom groom = support::make_odd_groom();
  const double hair = support::hair_length(groom) * static_cast<double>(Material{}.linear_density_kg_per_m);
  for (const int n : {3, 5, 7, 10}) EXPECT_NEAR(sum(fill(groom, n).nodes.mass), 1.5 * hair, 1e-5 * hair);
}

TEST(Ether, a_node_that_moves_by_its_depth_is_in_balance_by_itself) {
  // Head tilted: in head axes gravity turns from d to d'. Freely hanging hair turns with it, which moves a point at
  // depth l by l (d' - d); the load of that node is m |g| (d' - d). Nodes at or above the roots stand stiff instead.
  const Filled filled = fill(make_curtain(), 8);
  const Vec3 turn = Vec3(0.6, -0.8, 0) - Vec3(0, -1, 0);
  std::size_t hanging = 0;
  for (std::size_t a = 0; a < filled.nodes.mass.size(); ++a) {
    const double depth = 0.1 - filled.grid.node_head(filled.geometry.active_nodes[a]).y();
    if (depth < kHangLengthMin) continue;
    ++hanging;
    const Vec3 ether = -filled.nodes.ether_stiffness[a] * depth * turn;
    const Vec3 load = filled.nodes.mass[a] * kGravity * turn;
    EXPECT_NEAR((ether + load).norm(), 0, 1e-4 * load.norm());
  }
  EXPECT_GT(hanging, filled.nodes.mass.size() / 2);
}

TEST(Ether, the_hanging_field_lies_in_the_lattice_exactly) {
  // Trilinear weights take node depths to the depth of the hair: the balance of nodes is that of the strand.
  const Groom groom = make_curtain();
  const Grid grid(fit_lattice(groom.points, {8, 8, 8}));
  for (const Vec3f& point : groom.points) {
    double depth = 0;
    for (const auto& [node, weight] : grid.weights(grid.from_head(point))) {
      depth += weight * (0.1 - grid.node_head(node).y());
    }
    EXPECT_NEAR(depth, 0.1 - static_cast<double>(point.y()), 1e-6);
  }
}

TEST(Ether, is_never_softer_than_free_hanging_and_no_stiffer_than_the_least_length) {
  for (const int n : {3, 5, 7, 10}) {
    const Groom groom = support::make_odd_groom();
    const Filled filled = fill(groom, n);
    for (std::size_t a = 0; a < filled.nodes.mass.size(); ++a) {
      const double length = filled.nodes.mass[a] * kGravity / filled.nodes.ether_stiffness[a];
      EXPECT_GE(length, kHangLengthMin * (1 - 1e-9));
      EXPECT_LE(length, 1);
    }
  }
}

// Gelled hair must be as stiff after a change of level as before.
TEST(Ether, gel_is_added_to_hanging_and_is_the_same_in_all_at_every_level) {
  const Groom plain = support::make_odd_groom();
  Groom gelled = plain;
  gelled.materials.base.ether_stiffness_per_s2 = 300;
  for (const int n : {3, 5, 7, 10}) {
    const Filled without = fill(plain, n), with = fill(gelled, n);
    EXPECT_NEAR(sum(with.nodes.ether_stiffness) - sum(without.nodes.ether_stiffness), 300 * sum(with.nodes.mass),
                1e-6 * sum(with.nodes.ether_stiffness));
    for (std::size_t a = 0; a < with.nodes.mass.size(); ++a) {
      EXPECT_NEAR((with.nodes.ether_stiffness[a] - without.nodes.ether_stiffness[a]) / with.nodes.mass[a], 300, 1e-6);
    }
  }
}

TEST(Ether, damps_each_nodes_own_swing_by_the_ratio) {
  Groom groom = support::make_odd_groom();
  groom.materials.base.ether_stiffness_per_s2 = 100;
  groom.materials.base.ether_damping_ratio = 0.35f;
  const Filled filled = fill(groom, 7);
  for (std::size_t a = 0; a < filled.nodes.mass.size(); ++a) {
    const double m = filled.nodes.mass[a], k = filled.nodes.ether_stiffness[a], q = filled.nodes.ether_damping[a];
    EXPECT_NEAR(q / (2 * std::sqrt(k * m)), 0.35, 1e-6);
  }
}

TEST(Ether, groups_keep_their_own_materials) {
  // The groom has a gelled fringe in front of a soft tail, far enough apart to share no node.
  Groom groom;
  for (int s = 0; s < 9; ++s) {
    const Vec3f root(0.01f * static_cast<float>(s), 0.1f, 0);
    support::add(groom, support::straight(root + Vec3f(0, 0, 0.3f), {0, -1, 0}, 0.3f, 12), {.group = 0});
    support::add(groom, support::straight(root - Vec3f(0, 0, 0.3f), {0, -1, 0}, 0.3f, 12), {.group = 1});
  }
  groom.materials.base.ether_damping_ratio = 0.15f;
  Material gel;
  gel.ether_stiffness_per_s2 = 400;
  gel.ether_damping_ratio = 0.6f;
  gel.ether_mass_ratio = 0.9f;
  groom.materials.set(0, gel);
  const Filled filled = fill(groom, 8);
  std::size_t in_fringe = 0, in_tail = 0;
  for (std::size_t a = 0; a < filled.nodes.mass.size(); ++a) {
    const std::uint32_t node = filled.geometry.active_nodes[a];
    if (filled.lumped.mass[node] == 0) continue;
    const bool is_fringe = filled.grid.node_head(node).z() > 0;
    (is_fringe ? in_fringe : in_tail)++;
    const double m = filled.nodes.mass[a], k = filled.nodes.ether_stiffness[a], q = filled.nodes.ether_damping[a];
    const double hang = kGravity * filled.lumped.mass[node] / filled.lumped.hang_moment[node];
    EXPECT_NEAR(k / m - hang, is_fringe ? 400 : 0, 1e-4);
    EXPECT_NEAR(q / (2 * std::sqrt(k * m)), is_fringe ? 0.6 : 0.15, 1e-6);
  }
  EXPECT_GT(in_fringe, 10u);
  EXPECT_GT(in_tail, 10u);
  const double hair = sum(filled.lumped.mass);
  // Half of the hair has an ether of 0.9 times its mass, and the other half the default of 0.5.
  EXPECT_NEAR(sum(filled.nodes.mass), hair * (1 + 0.5 * (0.9 + 0.5)), 1e-5 * hair);
}

TEST(Ether, hair_that_stands_up_stands_stiff) {
  Groom groom;
  for (int s = 0; s < 10; ++s) {
    support::add(groom, support::straight({0.01f * static_cast<float>(s), 0, 0}, {0, 1, 0}, 0.1f, 5));
  }
  const Filled filled = fill(groom, 6);
  // Hair that hangs l below its root has the stiffness of a pendulum, g / l for each kilogram. Where it does not hang,
  // kHangLengthMin stands for l.
  const double stiff = kGravity / kHangLengthMin;
  for (std::size_t a = 0; a < filled.nodes.mass.size(); ++a) {
    // Nodes just below the roots hang by the margin of the lattice, half a cell.
    if (filled.grid.node_head(filled.geometry.active_nodes[a]).y() < 0) continue;
    EXPECT_NEAR(filled.nodes.ether_stiffness[a] / filled.nodes.mass[a], stiff, 1e-6 * stiff);
  }
}

TEST(Ether, nodes_without_hair_and_grooms_without_length_have_mass_and_stiffness) {
  Groom groom;
  support::add(groom, {{0.1f, 0.1f, 0.1f}});
  const Filled filled = fill(groom, 5);
  ASSERT_FALSE(filled.nodes.mass.empty());
  for (std::size_t a = 0; a < filled.nodes.mass.size(); ++a) {
    EXPECT_GT(filled.nodes.mass[a], 0);
    EXPECT_GT(filled.nodes.ether_stiffness[a], 0);
    EXPECT_TRUE(std::isfinite(filled.nodes.ether_stiffness[a]));
  }
}

}  // namespace
}  // namespace hairnet
