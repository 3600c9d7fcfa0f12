#include <gtest/gtest.h>

#include <numeric>

#include "core/levels/fit_lattice.hpp"
#include "core/levels/lumped_hair.hpp"
#include "core/levels/resample.hpp"
#include "tests/support/build_grooms.hpp"

namespace hairnet {
namespace {

// Lumps all strands of a groom onto the nodes of the grid: mass, drag and hanging length.
LumpedHair shares_of(const Groom& groom, const Grid& grid) {
  LumpedHair lumped(grid.node_count());
  std::vector<Vec3> polyline;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    polyline_on_grid(grid, groom.strand_points(s), polyline);
    lump_strand(grid, polyline, groom.strands[s], {}, lumped);
  }
  return lumped;
}

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

Grid grid_of(const Groom& groom, int n) {
  return Grid(fit_lattice(groom.points, {n, n, n}));
}

TEST(LumpedHair, mass_is_the_hairs_own_at_every_lattice_size) {
  const Groom groom = support::make_odd_groom();
  const double mass = support::hair_length(groom) * static_cast<double>(Material{}.linear_density_kg_per_m);
  // A coarser level must not weigh more, or a change of level would change how hair swings.
  for (const int n : {3, 4, 5, 7, 10}) EXPECT_NEAR(sum(shares_of(groom, grid_of(groom, n)).mass), mass, 1e-5 * mass);
}

// A shifted centre of mass would let hair pull its lattice to one side under gravity.
TEST(LumpedHair, nodes_balance_on_the_hairs_centre_of_mass) {
  const Groom groom = support::make_odd_groom();
  const Grid grid = grid_of(groom, 6);
  const LumpedHair lumped = shares_of(groom, grid);
  Vec3 of_nodes = Vec3::Zero(), of_hair = Vec3::Zero();
  for (std::uint32_t node = 0; node < grid.node_count(); ++node) of_nodes += lumped.mass[node] * grid.node_head(node);
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const auto points = groom.strand_points(s);
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Vec3 a = points[i - 1].cast<double>(), b = points[i].cast<double>();
      of_hair += static_cast<double>(groom.strands[s].hair_count) * (b - a).norm() * (a + b) / 2;
    }
  }
  EXPECT_NEAR((of_nodes / sum(lumped.mass) - of_hair / support::hair_length(groom)).norm(), 0, 1e-6);
}

TEST(LumpedHair, drag_of_a_straight_strand_lets_air_pass_along_it) {
  Groom groom;
  const Vec3f direction = Vec3f(1, -2, 0.5f).normalized();
  support::add(groom, support::straight({0, 0, 0}, direction, 0.3f, 4), {.hair_count = 10});
  const Grid grid = grid_of(groom, 6);
  const LumpedHair lumped = shares_of(groom, grid);
  Mat3 drag = Mat3::Zero();
  for (const auto& [xx, xy, xz, yy, yz, zz] : lumped.drag)
    drag += (Mat3() << xx, xy, xz, xy, yy, yz, xz, yz, zz).finished();
  const Vec3 e = direction.cast<double>();
  // Air acts across a hair alone, so the matrix is the drag times length times the projection across the strand.
  const Mat3 expected =
      10 * static_cast<double>(Material{}.air_drag_ns_per_m2) * 0.3 * (Mat3::Identity() - e * e.transpose());
  EXPECT_NEAR((drag - expected).norm(), 0, 1e-5 * expected.norm());
  EXPECT_NEAR((drag * e).norm(), 0, 1e-5 * expected.norm());
}

TEST(LumpedHair, drag_has_twice_its_coefficient_times_length_for_a_trace) {
  const Groom groom = support::make_odd_groom();
  const LumpedHair lumped = shares_of(groom, grid_of(groom, 7));
  double trace = 0;
  for (const auto& q : lumped.drag) trace += q[0] + q[3] + q[5];
  const double expected = 2 * static_cast<double>(Material{}.air_drag_ns_per_m2) * support::hair_length(groom);
  EXPECT_NEAR(trace, expected, 1e-5 * expected);
}

TEST(LumpedHair, do_not_depend_on_how_finely_a_strand_is_drawn) {
  Groom coarse, fine;
  support::add(coarse, support::straight({0.013f, 0.02f, 0}, {1, -2, 0.7f}, 0.3f, 1));
  support::add(fine, support::straight({0.013f, 0.02f, 0}, {1, -2, 0.7f}, 0.3f, 300));
  const Grid grid = grid_of(coarse, 7);
  const LumpedHair a = shares_of(coarse, grid), b = shares_of(fine, grid);
  for (std::uint32_t node = 0; node < grid.node_count(); ++node) {
    EXPECT_NEAR(a.mass[node], b.mass[node], 1e-4 * sum(a.mass));
  }
}

TEST(LumpedHair, a_curl_keeps_its_arc_length) {
  Groom groom;
  support::add(groom, support::curl({0, 0, 0}, 0.02f, 0.1f, 6, 300));
  const double mass = sum(shares_of(groom, grid_of(groom, 5)).mass);
  // A strand of support::add() stands for 10 hairs by default, here of a chord of 10 cm.
  const double chord_mass = 10 * 0.1 * static_cast<double>(Material{}.linear_density_kg_per_m);
  // Six turns of a radius of 2 cm are 75 cm of hair on a length of 10 cm.
  EXPECT_GT(mass, 5 * chord_mass);
}

TEST(LumpedHair, hair_along_a_lattice_line_touches_that_line_alone) {
  Lattice lattice;
  lattice.dims = {5, 5, 5};
  lattice.spacing = Vec3f::Constant(0.1f);
  const Grid grid(lattice);
  Groom groom;
  support::add(groom, {{0.1f, 0.2f, 0.3f}, {0.3f, 0.2f, 0.3f}});
  const LumpedHair lumped = shares_of(groom, grid);
  for (std::uint32_t node = 0; node < grid.node_count(); ++node) {
    const auto [i, j, k] = lattice.coordinates(node);
    // The strand goes from x = 1 to x = 3 in cells, on a line of nodes, so all other nodes have no share of it.
    EXPECT_EQ(lumped.touched[node], j == 2 && k == 3 && i >= 1 && i <= 3) << i << ' ' << j << ' ' << k;
    EXPECT_EQ(lumped.mass[node] > 0, lumped.touched[node]);
  }
}

TEST(LumpedHair, hair_through_a_cell_touches_its_eight_nodes) {
  Lattice lattice;
  lattice.dims = {6, 6, 6};
  const Grid grid(lattice);
  Groom groom;
  support::add(groom, {{1.25f, 1.5f, 1.75f}, {4.5f, 3.75f, 2.5f}});
  const LumpedHair lumped = shares_of(groom, grid);
  for (int i = 0; i <= 1000; ++i) {
    const Vec3 point = Vec3(1.25, 1.5, 1.75) + i / 1000.0 * Vec3(3.25, 2.25, 0.75);
    for (const auto& [node, weight] : grid.weights(point)) EXPECT_TRUE(lumped.touched[node]);
  }
}

TEST(LumpedHair, hanging_length_is_depth_below_the_root_and_never_too_small) {
  Groom groom;
  support::add(groom, support::straight({0, 0.1f, 0}, {0.001f, -1, 0}, 0.4f, 10));
  const Grid grid = grid_of(groom, 8);
  const LumpedHair lumped = shares_of(groom, grid);
  for (std::uint32_t node = 0; node < grid.node_count(); ++node) {
    if (lumped.mass[node] == 0) continue;
    const double depth = 0.1 - grid.node_head(node).y();
    // The ether's stiffness is mass times gravity over this length, so a length near 0 would make it infinitely
    // stiff.
    EXPECT_NEAR(lumped.hang_moment[node] / lumped.mass[node], std::max(depth, kHangLengthMin), 1e-6);
  }
}

TEST(LumpedHair, a_single_point_touches_its_nodes_without_mass) {
  Groom groom;
  support::add(groom, {{0.1f, 0.1f, 0.1f}});
  const LumpedHair lumped = shares_of(groom, grid_of(groom, 4));
  EXPECT_EQ(sum(lumped.mass), 0);
  EXPECT_GT(std::count(lumped.touched.begin(), lumped.touched.end(), true), 0);
}

}  // namespace
}  // namespace hairnet
