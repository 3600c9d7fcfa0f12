#include "core/levels/resample.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/levels/fit_lattice.hpp"
#include "tests/support/build_grooms.hpp"

namespace hairnet {
namespace {

// Makes a grid of n nodes an axis whose first node is the origin; a cell has a size of 1 unless given.
Grid unit_grid(int n, const Vec3f& spacing = Vec3f::Ones()) {
  Lattice lattice;
  lattice.dims = {n, n, n};
  lattice.spacing = spacing;
  return Grid(lattice);
}

// Returns the places, in cells, where resampling cuts the strand into pieces, with both ends.
std::vector<Vec3> cuts_of(const Grid& grid, const std::vector<Vec3f>& strand) {
  std::vector<Vec3> polyline, cuts;
  polyline_on_grid(grid, strand, polyline);
  cut_points(grid, polyline, cuts);
  return cuts;
}

bool on_plane(double x) {
  return x == std::round(x);
}

TEST(FitLattice, leaves_half_a_cell_of_margin_on_every_side) {
  const std::vector<Vec3f> points{{-1, 0, 2}, {3, 5, 2.5f}, {0, 1, 2.2f}};
  const Lattice lattice = fit_lattice(points, {10, 7, 5});
  for (int axis = 0; axis < 3; ++axis) {
    const float low = std::min({points[0][axis], points[1][axis], points[2][axis]});
    const float high = std::max({points[0][axis], points[1][axis], points[2][axis]});
    const float end = lattice.origin[axis] + lattice.spacing[axis] * static_cast<float>(lattice.dims[axis] - 1);
    EXPECT_NEAR(low - lattice.origin[axis], 0.5f * lattice.spacing[axis], 1e-5f);
    EXPECT_NEAR(end - high, 0.5f * lattice.spacing[axis], 1e-5f);
  }
}

TEST(FitLattice, contains_every_point_of_odd_grooms_at_every_size) {
  const Groom groom = support::make_odd_groom();
  for (const int n : {3, 4, 5, 10, 20}) {
    const Grid grid(fit_lattice(groom.points, {n, n, n}));
    for (const Vec3f& point : groom.points) {
      const Vec3 at = grid.from_head(point);
      // The margin is half a cell; a hundredth of a cell is left for rounding.
      EXPECT_GE(at.minCoeff(), 0.49);
      EXPECT_LE(at.maxCoeff(), n - 1 - 0.49);
    }
  }
}

TEST(FitLattice, gives_points_without_extent_a_cell_of_its_own_size) {
  const std::vector<Vec3f> one{{0.1f, 0.2f, 0.3f}};
  const Lattice lattice = fit_lattice(one, {5, 5, 5});
  // The smallest spacing is kSpacingMin = 1 cm, stored as a float.
  EXPECT_GE(lattice.spacing.minCoeff(), 0.0099f);
  EXPECT_NEAR((Grid(lattice).from_head(one[0]) - Vec3(2, 2, 2)).norm(), 0, 1e-5);
  EXPECT_GT(fit_lattice({}, {3, 3, 3}).spacing.minCoeff(), 0);
}

// All forces of the lattice go through these weights. An error in them would create momentum from nothing.
TEST(Grid, trilinear_weights_reproduce_the_point_and_sum_to_one) {
  const Groom groom = support::make_odd_groom();
  const Grid grid(fit_lattice(groom.points, {7, 6, 5}));
  for (const Vec3f& point : groom.points) {
    double sum = 0;
    Vec3 at = Vec3::Zero();
    std::uint32_t before = 0;
    for (const auto& [node, weight] : grid.weights(grid.from_head(point))) {
      EXPECT_GT(weight, 0);
      if (sum > 0) {
        EXPECT_GT(node, before);
      }
      before = node;
      sum += weight;
      at += weight * grid.node_head(node);
    }
    EXPECT_NEAR(sum, 1, 1e-14);
    EXPECT_NEAR((at - point.cast<double>()).norm(), 0, 1e-6);
  }
}

TEST(Grid, a_point_on_the_far_border_weighs_on_border_nodes_only) {
  const Grid grid = unit_grid(4);
  const TrilinearWeights corner = grid.weights(Vec3(3, 3, 3));
  ASSERT_EQ(corner.count, 1);
  EXPECT_EQ(corner.entries[0].node, 63u);
  EXPECT_EQ(grid.weights(Vec3(3, 1.5, 1.5)).count, 4);
}

TEST(CutPoints, a_strand_across_cells_is_cut_at_each_face) {
  const auto cuts = cuts_of(unit_grid(6), {{0.5f, 2.25f, 2.25f}, {4.5f, 2.75f, 2.5f}});
  ASSERT_EQ(cuts.size(), 6u);
  for (int i = 1; i <= 4; ++i) EXPECT_EQ(cuts[i].x(), i);
}

TEST(CutPoints, a_body_diagonal_is_cut_once_a_cell) {
  const auto cuts = cuts_of(unit_grid(6), {{0.5f, 0.4f, 0.3f}, {4.5f, 4.4f, 4.3f}});
  ASSERT_EQ(cuts.size(), 6u);
  for (int i = 1; i <= 4; ++i) {
    EXPECT_TRUE(on_plane(cuts[i].x()) || on_plane(cuts[i].y()) || on_plane(cuts[i].z()));
  }
}

TEST(CutPoints, a_body_diagonal_through_corners_meets_one_node_a_cut) {
  const Grid grid = unit_grid(6);
  const auto cuts = cuts_of(grid, {{0.5f, 0.5f, 0.5f}, {4.5f, 4.5f, 4.5f}});
  ASSERT_EQ(cuts.size(), 6u);
  for (std::size_t i = 1; i + 1 < cuts.size(); ++i)
    EXPECT_NEAR(grid.weights(cuts[i]).entries[grid.weights(cuts[i]).count - 1].weight, 1, 1e-12);
}

TEST(CutPoints, every_crossing_at_more_than_45_degrees_is_cut) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const std::vector<Vec3f> strand = support::wander(random, 12);
    const Grid grid(fit_lattice(strand, {6, 6, 6}));
    std::vector<Vec3> polyline, cuts;
    polyline_on_grid(grid, strand, polyline);
    cut_points(grid, polyline, cuts);
    for (std::size_t i = 1; i < polyline.size(); ++i) {
      const Vec3 along = (polyline[i] - polyline[i - 1]).cwiseProduct(grid.spacing()).normalized();
      for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(along[axis]) <= std::sqrt(0.5)) continue;
        const double low = std::min(polyline[i - 1][axis], polyline[i][axis]);
        const double high = std::max(polyline[i - 1][axis], polyline[i][axis]);
        for (double plane = std::ceil(low); plane <= high; ++plane) {
          const double t = (plane - polyline[i - 1][axis]) / (polyline[i][axis] - polyline[i - 1][axis]);
          const Vec3 crossing = polyline[i - 1] + t * (polyline[i] - polyline[i - 1]);
          double nearest = 1e9;
          for (const Vec3& cut : cuts) nearest = std::min(nearest, grid.length(cut - crossing));
          // The nearest cut is the crossing itself, unless the piece up to it was too short and was merged with its
          // neighbour.
          EXPECT_LE(nearest, 1.01 * piece_length_min(grid));
        }
      }
    }
  }
}

TEST(CutPoints, interior_cuts_weigh_on_four_nodes_at_most) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 400; ++trial) {
    // Strands of two long segments have the largest rounding errors.
    const std::vector<Vec3f> strand = support::wander(random, trial % 2 ? 20 : 2);
    const Grid grid(fit_lattice(strand, {20, 20, 20}));
    const auto cuts = cuts_of(grid, strand);
    for (std::size_t i = 1; i + 1 < cuts.size(); ++i) EXPECT_LE(grid.weights(cuts[i]).count, 4);
  }
}

// The stiffness of a spring grows with 1 / length, so a tiny piece would make the equations hard to solve.
TEST(CutPoints, root_and_tip_stay_and_no_piece_is_shorter_than_a_tenth_of_a_cell) {
  std::mt19937 random(6);
  for (int trial = 0; trial < 300; ++trial) {
    const std::vector<Vec3f> strand = support::wander(random, 30);
    const Grid grid(fit_lattice(strand, {9, 9, 9}));
    const auto cuts = cuts_of(grid, strand);
    EXPECT_EQ(cuts.front(), grid.from_head(strand.front()));
    EXPECT_EQ(cuts.back(), grid.from_head(strand.back()));
    if (cuts.size() == 2) continue;
    for (std::size_t i = 1; i < cuts.size(); ++i) {
      EXPECT_GE(grid.length(cuts[i] - cuts[i - 1]), piece_length_min(grid) * (1 - 1e-9));
    }
  }
}

TEST(CutPointsDeathTest, asserts_that_the_polyline_has_two_points) {
  EXPECT_DEATH(cuts_of(unit_grid(4), {{1.1f, 1.2f, 1.3f}}), "polyline.size\\(\\) >= 2");
}

TEST(CutPoints, a_strand_inside_one_cell_is_one_piece) {
  EXPECT_EQ(cuts_of(unit_grid(4), {{1.1f, 1.2f, 1.3f}, {1.4f, 1.6f, 1.2f}, {1.9f, 1.8f, 1.7f}}).size(), 2u);
}

TEST(CutPoints, a_strand_in_a_lattice_plane_weighs_on_that_plane_alone) {
  const Grid grid = unit_grid(6);
  const auto cuts = cuts_of(grid, {{0.5f, 2, 1.25f}, {4.5f, 2, 3.25f}});
  ASSERT_EQ(cuts.size(), 6u);
  for (std::size_t i = 1; i + 1 < cuts.size(); ++i) {
    EXPECT_EQ(cuts[i].y(), 2);
    EXPECT_LE(grid.weights(cuts[i]).count, 2);
  }
}

TEST(CutPoints, a_strand_along_a_lattice_line_weighs_on_single_nodes) {
  const Grid grid = unit_grid(6, Vec3f(0.1f, 0.1f, 0.1f));
  const auto cuts = cuts_of(grid, {{0.05f, 0.2f, 0.3f}, {0.45f, 0.2f, 0.3f}});
  ASSERT_EQ(cuts.size(), 6u);
  for (std::size_t i = 1; i + 1 < cuts.size(); ++i) EXPECT_EQ(grid.weights(cuts[i]).count, 1);
}

TEST(CutPoints, a_vertex_on_a_plane_is_one_cut) {
  const auto cuts = cuts_of(unit_grid(6), {{0.5f, 2.5f, 2.5f}, {2, 2.5f, 2.5f}, {3.5f, 2.5f, 2.5f}});
  ASSERT_EQ(cuts.size(), 5u);
  for (int i = 1; i <= 3; ++i) EXPECT_EQ(cuts[i].x(), i);
}

// Cells are a quarter as long along y as along x. The strand crosses more planes of y, but is longer in metres along x,
// so x decides.
TEST(CutPoints, the_axis_run_most_along_is_measured_in_metres) {
  // The strand goes 3 cells along x and 4 along y, which are 3 m and 1 m.
  const Grid grid = unit_grid(8, Vec3f(1, 0.25f, 1));
  const auto cuts = cuts_of(grid, {{0.5f, 0.3f, 2.5f}, {3.5f, 1.3f, 2.5f}});
  ASSERT_EQ(cuts.size(), 5u);
  for (int i = 1; i <= 3; ++i) EXPECT_EQ(cuts[i].x(), i);
}

TEST(CutPoints, the_finest_drawing_of_a_strand_is_cut_at_the_same_places) {
  const Grid grid = unit_grid(8);
  const auto coarse = cuts_of(grid, support::straight({0.5f, 0.6f, 0.7f}, {3, 2, 1}, 6, 1));
  const auto fine = cuts_of(grid, support::straight({0.5f, 0.6f, 0.7f}, {3, 2, 1}, 6, 500));
  ASSERT_EQ(coarse.size(), fine.size());
  for (std::size_t i = 0; i < coarse.size(); ++i) EXPECT_NEAR((coarse[i] - fine[i]).norm(), 0, 1e-4);
}

}  // namespace
}  // namespace hairnet
