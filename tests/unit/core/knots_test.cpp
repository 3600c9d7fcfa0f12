#include "core/levels/knots.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "core/ffd/deform.hpp"
#include "core/levels/build.hpp"
#include "core/solver/spring.hpp"
#include "core/solver/step.hpp"
#include "tests/support/levels.hpp"
#include "tests/unit/core/build_lists.hpp"
#include "tests/unit/core/level_checks.hpp"

namespace hairnet {
namespace {

constexpr int kPointsOfStrand = 16;

// Makes two locks of nine strands each, which hang `apart_m` from each other, away from any body.
Groom make_two_locks(float apart_m) {
  Groom groom;
  groom.group_names = {"hair"};
  for (const float side : {-0.5f, 0.5f}) {
    for (int s = 0; s < 9; ++s) {
      const Vec3f root(side * apart_m + 0.002f * static_cast<float>(s % 3 - 1), 0, 0.002f * static_cast<float>(s / 3));
      std::vector<Vec3f> strand;
      for (int i = 0; i < kPointsOfStrand; ++i) strand.push_back(root - Vec3f(0, 0.02f * static_cast<float>(i), 0));
      groom.add_strand(strand, {.hair_count = 50, .root_length_m = 0});
    }
  }
  return groom;
}

// Returns the point half-way down every strand, where tests tie the locks.
std::vector<std::uint32_t> middles(const Groom& groom) {
  std::vector<std::uint32_t> points;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) points.push_back(groom.strand_begin[s] + kPointsOfStrand / 2);
  return points;
}

// Returns the groom's points in head space after the head has turned about the vertical for three seconds, faster and
// faster in the first: the hair is flung outwards.
std::vector<Vec3f> points_in_spin(const Groom& groom, const Level& level, double radians_per_s) {
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  StepInput input;
  input.step_s = 1.0 / 100;
  // A tick is 1/100 s. The speed rises evenly in the first 100 ticks and then stays.
  for (int tick = 1; tick <= 300; ++tick) {
    input.from = input.to;
    const double speed = radians_per_s * std::min(1.0, tick / 100.0);
    input.to = rigid_pose(support::turned(speed * input.step_s, Vec3::UnitY()) * input.from.head());
    EXPECT_TRUE(step(level, input, {.iterations = 60}, scratch, state));
  }
  std::vector<Vec3f> grid(level.geometry.lattice.node_count()), points(groom.points.size());
  expand_displacements(level.geometry, state.displacement, grid);
  Deformer(groom, level.geometry.lattice, FfdKind::linear).deform(grid, points);
  return points;
}

// Returns how much the distance between the tied parts of the two locks has changed, m.
double change_between_locks(const Groom& groom, const std::vector<Vec3f>& points) {
  const auto apart = [&](const std::vector<Vec3f>& at) {
    Vec3f sum = Vec3f::Zero();
    const std::vector<std::uint32_t> tied = middles(groom);
    for (std::size_t i = 0; i < tied.size(); ++i) sum += (i < tied.size() / 2 ? -1.0f : 1.0f) * at[tied[i]];
    return static_cast<double>(sum.norm()) / static_cast<double>(tied.size() / 2);
  };
  return std::abs(apart(points) - apart(groom.points));
}

TEST(Knots, keep_strands_together_that_would_be_flung_apart) {
  const Groom loose = make_two_locks(0.06f);
  Groom tied = loose;
  tied.knots.push_back({.points = middles(tied)});
  ASSERT_EQ(validate(tied), "");
  // A knot must reduce the movement to the share that stands beside the level. A cell of the coarse lattice is 10 cm
  // high, so its ties resist less.
  for (const auto& [level, share] : {std::pair{0u, 0.05}, {1u, 0.10}, {2u, 0.25}}) {
    const LevelSpec& spec = kLevelSpecs[level];
    // 11 rad/s are nearly two turns a second, far more than a head turns on its own.
    const double loose_m = change_between_locks(loose, points_in_spin(loose, *build_level(loose, spec), 11));
    const double tied_m = change_between_locks(tied, points_in_spin(tied, *build_level(tied, spec), 11));
    EXPECT_GT(loose_m, 0.006) << "strong enough a pull to tell";
    EXPECT_LT(tied_m, share * loose_m) << "level " << level;
  }
}

TEST(Knots, two_points_are_enough) {
  Groom groom = make_two_locks(0.06f);
  groom.knots.push_back({.points = {kPointsOfStrand / 2, 9 * kPointsOfStrand + kPointsOfStrand / 2}});
  const auto points = points_in_spin(groom, *build_level(groom, kLevelSpecs[0]), 11);
  const std::uint32_t a = groom.knots[0].points[0], b = groom.knots[0].points[1];
  EXPECT_NEAR((points[a] - points[b]).norm(), (groom.points[a] - groom.points[b]).norm(), 1e-3);
}

struct BuiltKnot {
  Grid grid;
  StiffenerList ties;
};

// Builds the ties of one knot on a lattice of a cube of 20 cm.
BuiltKnot build_knot(const std::vector<Vec3f>& points, int nodes_per_axis) {
  std::vector<Vec3f> around = points;
  around.insert(around.end(), {Vec3f(-0.1f, -0.1f, -0.1f), Vec3f(0.1f, 0.1f, 0.1f)});
  BuiltKnot built{Grid(fit_lattice(around, {nodes_per_axis, nodes_per_axis, nodes_per_axis})), {}};
  Knot knot;
  knot.points.resize(points.size());
  std::iota(knot.points.begin(), knot.points.end(), 0u);
  add_knot(built.grid, points, knot, 0, built.ties);
  return built;
}

Vec3 weighted(const StiffenerList& list, std::size_t s, const std::vector<Vec3>& nodes) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [node, weight] : list.weights(s)) sum += weight * nodes[node];
  return sum;
}

std::vector<Vec3> rest_nodes(const Grid& grid) {
  std::vector<Vec3> nodes;
  for (std::uint32_t n = 0; n < grid.node_count(); ++n) nodes.push_back(grid.node_head(n));
  return nodes;
}

// Eight points lie on a circle of 12 mm in a horizontal plane, like strands in a hair tie.
const std::vector<Vec3f> kRing{{0.012f, 0, 0},  {0.0085f, 0, 0.0085f},   {0, 0, 0.012f},  {-0.0085f, 0, 0.0085f},
                               {-0.012f, 0, 0}, {-0.0085f, 0, -0.0085f}, {0, 0, -0.012f}, {0.0085f, 0, -0.0085f}};

// Forces within a knot must cancel, or a hair tie would lift or turn the whole head of hair.
TEST(Knots, exert_no_force_and_no_torque_as_a_whole) {
  const BuiltKnot knot = build_knot(kRing, 8);
  std::mt19937 random(1);
  const std::vector<Vec3> rest = rest_nodes(knot.grid);
  std::vector<Vec3> nodes = rest, forces(rest.size(), Vec3::Zero());
  for (Vec3& p : nodes) p += support::random_vec(random, 0.01f).cast<double>();
  double largest = 0;
  for (std::size_t s = 0; s < knot.ties.count(); ++s) {
    const double length = weighted(knot.ties, s, rest).norm();
    const Vec3 sigma = spring_force(knot.ties.stiffness[s], 0, length, weighted(knot.ties, s, nodes), Vec3::Zero());
    largest = std::max(largest, sigma.norm());
    for (const auto& [node, weight] : knot.ties.weights(s)) forces[node] += weight * sigma;
  }
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    force += forces[n];
    moment += nodes[n].cross(forces[n]);
  }
  ASSERT_GT(largest, 0.01);
  EXPECT_LT(force.norm(), 1e-9 * largest);
  EXPECT_LT(moment.norm(), 1e-9 * largest);
}

// Returns twice the energy of the ties in the field x -> x + gradient x, divided by the square of the gradient's
// norm.
double stiffness_against(const BuiltKnot& knot, const Mat3& gradient) {
  const std::vector<Vec3> rest = rest_nodes(knot.grid);
  std::vector<Vec3> moved;
  for (const Vec3& p : rest) moved.push_back(gradient * p);
  double sum = 0;
  for (std::size_t s = 0; s < knot.ties.count(); ++s) {
    const Vec3 along = weighted(knot.ties, s, rest).normalized();
    const double stretch = along.dot(weighted(knot.ties, s, moved));
    sum += knot.ties.stiffness[s] * stretch * stretch;
  }
  return sum / gradient.squaredNorm();
}

// A truss that gives way in one direction would let tied hair slide apart there. No strain may be 200 times as easy
// as another.
TEST(Knots, resist_every_strain_even_when_the_points_lie_in_a_plane_or_on_a_line) {
  std::mt19937 random(2);
  for (const std::vector<Vec3f>& points :
       {kRing, std::vector<Vec3f>{{-0.01f, 0, 0}, {0.01f, 0, 0}}, std::vector<Vec3f>{{0.031f, 0, 0}, {0.032f, 0, 0}}}) {
    const BuiltKnot knot = build_knot(points, 6);
    double least = 1e9, most = 0;
    for (int i = 0; i < 200; ++i) {
      Mat3 strain;
      for (int c = 0; c < 3; ++c) strain.col(c) = support::random_vec(random, 1).cast<double>();
      strain = (strain + strain.transpose()).eval();
      least = std::min(least, stiffness_against(knot, strain));
      most = std::max(most, stiffness_against(knot, strain));
    }
    EXPECT_GT(least, 0.005 * most);
    Mat3 turn = Mat3::Zero();
    turn(0, 1) = 1;
    turn(1, 0) = -1;
    EXPECT_LT(stiffness_against(knot, turn), 1e-6 * most) << "turning as a whole is free";
  }
}

TEST(Knots, of_points_at_one_place_have_nothing_to_do) {
  EXPECT_EQ(build_knot(std::vector<Vec3f>(5, Vec3f(0.01f, 0, 0)), 6).ties.count(), 0u);
}

TEST(Knots, are_small_trusses_however_many_points_they_tie) {
  std::mt19937 random(3);
  std::vector<Vec3f> points;
  for (int i = 0; i < 500; ++i) points.push_back(support::random_vec(random, 0.02f));
  // A truss has up to kKnotJointsMax joints and the four corners of a tetrahedron, and a spring between each two of
  // these.
  EXPECT_LE(build_knot(points, 8).ties.count(), (kKnotJointsMax + 4) * (kKnotJointsMax + 3) / 2);
}

// A clasp has a weight. The ether takes its share of it, as of hair.
TEST(Knots, may_have_a_weight_of_their_own) {
  Groom groom = make_two_locks(0.06f);
  groom.knots.push_back({.points = middles(groom)});
  const auto mass = [&] {
    const auto level = build_level(groom, kLevelSpecs[1]);
    support::expect_valid(*level);
    return std::accumulate(level->mass.begin(), level->mass.end(), 0.0);
  };
  const double without_kg = mass();
  groom.knots[0].mass_kg = 0.01f;
  EXPECT_NEAR(mass() - without_kg, 0.01 * (1 + static_cast<double>(Material{}.ether_mass_ratio)), 1e-6);
}

TEST(Knots, survive_the_merging_of_springs) {
  const Groom loose = make_two_locks(0.06f);
  Groom tied = loose;
  tied.knots.push_back({.points = middles(tied)});
  // A level of so few springs, 60 in place of 800, merges most springs of the hair, and must keep the ties all the
  // same.
  const LevelSpec scarce{{10, 10, 10}, 60, 10};
  LevelReport report;
  const auto level = build_level(tied, scarce, {}, &report);
  ASSERT_GT(report.springs_before, 3 * scarce.spring_count);
  EXPECT_EQ(level->springs.count(), scarce.spring_count);
  support::expect_valid(*level);
  const double loose_m = change_between_locks(loose, points_in_spin(loose, *build_level(loose, scarce), 11));
  EXPECT_LT(change_between_locks(tied, points_in_spin(tied, *level, 11)), 0.35 * loose_m)
      << "with a quarter of 60 springs";
}

}  // namespace
}  // namespace hairnet
