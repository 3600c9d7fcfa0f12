#include "core/levels/decimate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

#include "core/levels/nearest_chords.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/support/case_name.hpp"
#include "tests/unit/core/build_lists.hpp"

namespace hairnet {
namespace {

using support::attachments_of;
using support::dense;
using support::grid_of;
using support::springs_of;
using support::weight_matrix;

// Makes a grid of n nodes an axis, 1 m apart, with the first node at the origin.
Grid grid_of_cells(int n) {
  Lattice lattice;
  lattice.dims = {n, n, n};
  return Grid(lattice);
}

double total(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

// Returns the weighted sum of node positions: the vector along a spring, whose length is L in decimate.hpp.
Vec3 vector_of(const Grid& grid, const StiffenerList& list, std::size_t s) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [node, weight] : list.weights(s)) sum += weight * grid.node_head(node);
  return sum;
}

std::map<std::uint16_t, double> stiffness_by_group(const StiffenerList& list) {
  std::map<std::uint16_t, double> sums;
  for (std::size_t s = 0; s < list.count(); ++s) sums[list.group[s]] += list.stiffness[s];
  return sums;
}

// Sums k L^2 over the springs of each group: the resistance against a stretch of the whole hair.
std::map<std::uint16_t, double> stretch_by_group(const Grid& grid, const StiffenerList& springs) {
  std::map<std::uint16_t, double> sums;
  for (std::size_t s = 0; s < springs.count(); ++s) {
    sums[springs.group[s]] += springs.stiffness[s] * vector_of(grid, springs, s).squaredNorm();
  }
  return sums;
}

// Returns the sum over springs of k w (w.u): the forces on the nodes along a spring's direction when the lattice is
// stretched by u.
Eigen::VectorXd forces(const StiffenerList& springs, const Eigen::VectorXd& u) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(u.size());
  for (std::size_t s = 0; s < springs.count(); ++s) {
    const Eigen::VectorXd w = dense(springs, s, static_cast<std::size_t>(u.size()));
    sum += springs.stiffness[s] * w.dot(u) * w;
  }
  return sum;
}

// Implements Ward's clustering in the plain, quadratic way, to compare with: it merges the cheapest of all pairs of a
// group until `count` springs are left.
std::vector<Chord> merge_all_pairs(const Grid& grid, const StiffenerList& list, std::size_t count) {
  std::vector<Chord> chords = list.ends;
  std::vector<double> share, moment;
  std::vector<std::uint16_t> group = list.group;
  for (std::size_t s = 0; s < list.count(); ++s) {
    share.push_back(list.stiffness[s] * vector_of(grid, list, s).norm());
    moment.push_back(list.stiffness[s] * vector_of(grid, list, s).squaredNorm());
  }
  while (chords.size() > count) {
    double least = std::numeric_limits<double>::infinity();
    std::size_t a = 0, b = 0;
    for (std::size_t i = 0; i < chords.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const double cost = moment[i] * moment[j] / (moment[i] + moment[j]) * squared_distance(chords[i], chords[j]);
        if (group[i] == group[j] && cost < least) std::tie(least, a, b) = std::tuple(cost, j, i);
      }
    }
    if ((chords[a][1] - chords[a][0]).dot(chords[b][1] - chords[b][0]) < 0) std::swap(chords[b][0], chords[b][1]);
    for (const std::size_t end : {0u, 1u}) {
      chords[a][end] = (share[a] * chords[a][end] + share[b] * chords[b][end]) / (share[a] + share[b]);
    }
    share[a] += share[b];
    moment[a] += moment[b];
    const auto at = static_cast<std::ptrdiff_t>(b);
    chords.erase(chords.begin() + at);
    share.erase(share.begin() + at);
    moment.erase(moment.begin() + at);
    group.erase(group.begin() + at);
  }
  return chords;
}

// Returns the squared distance of each spring from the nearest of `left`, weighted by k L^2 and summed.
double spread(const Grid& grid, const StiffenerList& list, const std::vector<Chord>& left) {
  double sum = 0;
  for (std::size_t s = 0; s < list.count(); ++s) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Chord& chord : left) nearest = std::min(nearest, squared_distance(list.ends[s], chord));
    sum += list.stiffness[s] * vector_of(grid, list, s).squaredNorm() * nearest;
  }
  return sum;
}

class Decimating : public testing::TestWithParam<std::size_t> {};

TEST_P(Decimating, leaves_exactly_the_count_asked_for) {
  // Each of the 300 strands has one attachment, so fewer than 300 are asked for below.
  const Groom groom = support::make_head_of_hair(300);
  const Grid grid = grid_of(groom, 7);
  StiffenerList springs = springs_of(groom, grid), attachments = attachments_of(groom, grid);
  ASSERT_GT(springs.count(), GetParam());
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, GetParam(), springs));
  ASSERT_TRUE(decimate(grid, StiffenerKind::attachment, std::min<std::size_t>(GetParam(), 200), attachments));
  EXPECT_EQ(springs.count(), GetParam());
  EXPECT_EQ(attachments.count(), std::min<std::size_t>(GetParam(), 200));
  EXPECT_EQ(springs.begin.size(), springs.count() + 1);
  EXPECT_EQ(springs.begin.back(), springs.entries.size());
  EXPECT_EQ(springs.damping.size(), springs.count());
  EXPECT_EQ(springs.group.size(), springs.count());
  EXPECT_EQ(springs.ends.size(), springs.count());
}

INSTANTIATE_TEST_SUITE_P(Counts, Decimating, testing::Values(0, 1, 2, 3, 17, 100, 800),
                         support::CaseName{"_stiffeners"});

TEST(Decimating, keeps_all_there_are_when_asked_for_more) {
  const Groom groom = support::make_head_of_hair(20);
  const Grid grid = grid_of(groom, 5);
  const StiffenerList before = springs_of(groom, grid);
  StiffenerList after = before;
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, before.count(), after));
  EXPECT_EQ(after.stiffness, before.stiffness);
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, 100'000, after));
  EXPECT_EQ(after.stiffness, before.stiffness);
}

TEST(Decimating, an_empty_list_stays_empty) {
  const Grid grid = grid_of_cells(4);
  StiffenerList list;
  EXPECT_TRUE(decimate(grid, StiffenerKind::spring, 10, list));
  EXPECT_TRUE(decimate(grid, StiffenerKind::attachment, 0, list));
  EXPECT_EQ(list.count(), 0u);
}

TEST(Decimating, identical_springs_merge_exactly) {
  const Grid grid = grid_of_cells(4);
  StiffenerList springs;
  for (int i = 0; i < 50; ++i) {
    add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), {}, {}, springs);
    // A spring pulls the same whichever end comes first, so this one is identical to the one above.
    add_spring(grid, Vec3(2, 1.6, 1.7), Vec3(1, 1.3, 1.4), {}, {}, springs);
  }
  const Eigen::MatrixXd before = weight_matrix(springs, grid.node_count());
  const double k = total(springs.stiffness), q = total(springs.damping);
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, 1, springs));
  EXPECT_NEAR(springs.stiffness[0], k, 1e-10 * k);
  EXPECT_NEAR(springs.damping[0], q, 1e-10 * q);
  EXPECT_NEAR((weight_matrix(springs, grid.node_count()) - before).norm(), 0, 1e-10 * before.norm());
}

TEST(Decimating, two_bundles_of_identical_springs_become_two_springs_without_any_error) {
  const Grid grid = grid_of_cells(5);
  StiffenerList springs;
  for (int i = 0; i < 40; ++i) {
    add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), {}, {}, springs);
    add_spring(grid, Vec3(1.2, 2, 1.4), Vec3(1.5, 1, 1.7), {}, {}, springs);
  }
  const Eigen::MatrixXd before = weight_matrix(springs, grid.node_count());
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, 2, springs));
  EXPECT_NEAR((weight_matrix(springs, grid.node_count()) - before).norm(), 0, 1e-10 * before.norm());
}

// Fewer attachments must hold the hair as firmly as all of them did.
TEST(Decimating, attachments_keep_their_total_stiffness_in_each_group) {
  const Groom groom = support::make_head_of_hair(300);
  const Grid grid = grid_of(groom, 10);
  StiffenerList attachments = attachments_of(groom, grid);
  const auto before = stiffness_by_group(attachments);
  for (const std::size_t count : {200, 50, 10, 2}) {
    ASSERT_TRUE(decimate(grid, StiffenerKind::attachment, count, attachments));
    const auto after = stiffness_by_group(attachments);
    ASSERT_EQ(after.size(), before.size());
    for (const auto& [group, k] : before) EXPECT_NEAR(after.at(group), k, 1e-9 * k);
  }
}

// The first two of three attachments are 2.5 cells apart, and the third is 5.5 cells away, so the first two merge at
// their middle.
TEST(Decimating, the_nearest_attachments_merge_first) {
  const Grid grid = grid_of_cells(12);
  StiffenerList attachments;
  for (const double x : {1.5, 4.0, 9.5}) add_attachment(grid, Vec3(x, 2.5, 2.5), {}, {}, attachments);
  ASSERT_TRUE(decimate(grid, StiffenerKind::attachment, 2, attachments));
  ASSERT_EQ(attachments.count(), 2u);
  EXPECT_NEAR(attachments.stiffness[0], 2 * attachments.stiffness[1], 1e-12);
  // The place is the middle of 1.5 and 4.
  EXPECT_EQ(attachments.ends[0][0].x(), 2.75);
  EXPECT_EQ(attachments.ends[1][0].x(), 9.5);
}

// Groups have materials of their own, so a spring must belong to one group alone.
TEST(Decimating, springs_never_gain_from_another_group) {
  const Grid grid = grid_of_cells(4);
  StiffenerList springs;
  for (int i = 0; i < 20; ++i) {
    add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), {.hair_count = 1, .group = 0}, {}, springs);
    add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), {.hair_count = 5, .group = 1}, {}, springs);
  }
  const auto before = stiffness_by_group(springs);
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, 2, springs));
  const auto after = stiffness_by_group(springs);
  ASSERT_EQ(after.size(), 2u);
  for (const auto& [group, k] : before) EXPECT_NEAR(after.at(group), k, 1e-10 * k);
}

// Hair of a coarse level must stretch no more than hair of a fine one.
TEST(Decimating, springs_keep_their_resistance_to_stretching_in_each_group) {
  const Groom groom = support::make_head_of_hair(200);
  const Grid grid = grid_of(groom, 7);
  StiffenerList springs = springs_of(groom, grid);
  const auto before = stretch_by_group(grid, springs);
  for (const std::size_t count : {800, 200, 50}) {
    ASSERT_TRUE(decimate(grid, StiffenerKind::spring, count, springs));
    const auto after = stretch_by_group(grid, springs);
    ASSERT_EQ(after.size(), before.size());
    for (const auto& [group, stretch] : before) EXPECT_NEAR(after.at(group), stretch, 1e-9 * stretch);
  }
}

TEST(Decimating, parallel_springs_of_a_cell_pull_its_nodes_as_before_when_it_is_stretched) {
  const Grid grid = grid_of_cells(4);
  StiffenerList springs;
  const Vec3 along(1, 0.1, -0.2);
  for (int i = 0; i < 30; ++i) {
    const Vec3 from(1, 1.1 + 0.02 * i, 1.9 - 0.015 * i);
    // Every third spring is short, so that the merged one must weigh springs by their length.
    const double part = i % 3 == 0 ? 0.4 : 1;
    add_spring(grid, from, from + part * along, {.hair_count = 1.0f + static_cast<float>(i)}, {}, springs);
  }
  Eigen::VectorXd stretch(static_cast<Eigen::Index>(grid.node_count()));
  for (std::uint32_t n = 0; n < grid.node_count(); ++n) stretch[n] = 0.01 * grid.node_head(n).dot(along);
  const Eigen::VectorXd before = forces(springs, stretch);
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, 1, springs));
  EXPECT_NEAR((forces(springs, stretch) - before).norm(), 0, 1e-12 * before.norm());
}

// Chords of nearly opposite directions must be added with one of them reversed; else their sum would be a spring of
// almost no length.
TEST(Decimating, springs_that_run_against_each_other_do_not_cancel) {
  const Grid grid = grid_of_cells(4);
  StiffenerList springs;
  add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), {}, {}, springs);
  add_spring(grid, Vec3(2, 1.5, 1.7), Vec3(1, 1.2, 1.4), {}, {}, springs);
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, 1, springs));
  EXPECT_NEAR((vector_of(grid, springs, 0) - Vec3(1, 0.3, 0.3)).norm(), 0, 1e-12);
}

// Four groups of one spring each must become two springs. Groups never merge, so the springs of the fewest hairs go.
TEST(Decimating, more_groups_than_asked_for_lose_the_weakest) {
  const Grid grid = grid_of_cells(12);
  StiffenerList springs;
  const float hair_counts[] = {3, 1, 2, 5};
  for (std::uint16_t i = 0; i < 4; ++i) {
    add_spring(grid, Vec3(3, 1.3, 1.4), Vec3(4, 1.6, 1.7), {.hair_count = hair_counts[i], .group = i}, {}, springs);
  }
  const std::vector<double> k = springs.stiffness;
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, 2, springs));
  EXPECT_EQ(springs.stiffness, (std::vector<double>{k[0], k[3]}));
}

TEST(Decimating, merged_stiffeners_have_few_nodes_whose_weights_sum_up) {
  const Groom groom = support::make_head_of_hair(300);
  const Grid grid = grid_of(groom, 10);
  StiffenerList springs = springs_of(groom, grid), attachments = attachments_of(groom, grid);
  for (const std::size_t count : {500, 60, 2}) {
    ASSERT_TRUE(decimate(grid, StiffenerKind::spring, count, springs));
    ASSERT_TRUE(decimate(grid, StiffenerKind::attachment, count, attachments));
    for (std::size_t s = 0; s < springs.count(); ++s) {
      // A spring that was not merged may have the eight nodes of a cell at each of its two ends; a merged one has at
      // most kNodesPerEndMax = 4 there.
      EXPECT_LE(springs.weights(s).size(), 16u);
      EXPECT_NEAR(dense(springs, s, grid.node_count()).sum(), 0, 1e-12);
      EXPECT_TRUE(std::isfinite(springs.stiffness[s]) && springs.stiffness[s] > 0);
    }
    for (std::size_t s = 0; s < attachments.count(); ++s) {
      EXPECT_LE(attachments.weights(s).size(), kNodesPerAttachmentMax);
      EXPECT_NEAR(dense(attachments, s, grid.node_count()).sum(), 1, 1e-12);
    }
  }
}

TEST(Decimating, merged_stiffeners_act_on_no_node_that_none_acted_on) {
  const Groom groom = support::make_head_of_hair(300);
  const Grid grid = grid_of(groom, 10);
  for (const StiffenerKind kind : {StiffenerKind::spring, StiffenerKind::attachment}) {
    StiffenerList list = kind == StiffenerKind::spring ? springs_of(groom, grid) : attachments_of(groom, grid);
    std::vector<bool> had(grid.node_count(), false);
    for (const NodeWeight& entry : list.entries) had[entry.node] = true;
    ASSERT_TRUE(decimate(grid, kind, 30, list));
    EXPECT_TRUE(std::ranges::all_of(list.entries, [&](const NodeWeight& entry) { return had[entry.node]; }));
  }
}

// Decimation looks at near neighbours alone, which is much faster. The springs that are left may lie at most 10 % worse
// than those of all pairs.
TEST(Decimating, is_as_good_as_looking_at_all_pairs) {
  const Groom groom = support::make_head_of_hair(60);
  const Grid grid = grid_of(groom, 4);
  const StiffenerList before = springs_of(groom, grid);
  StiffenerList after = before;
  const std::size_t count = before.count() / 4;
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, count, after));
  EXPECT_LE(spread(grid, before, after.ends), 1.1 * spread(grid, before, merge_all_pairs(grid, before, count)));
}

TEST(Decimating, springs_along_one_line_compare_alike_whichever_way_they_run) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> range(0, 5);
  const auto vec = [&] {
    const double x = range(random), y = range(random), z = range(random);
    return Vec3(x, y, z);
  };
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 a = vec(), b = vec(), c = vec(), d = vec();
    EXPECT_EQ(squared_distance({a, b}, {b, a}), 0);
    EXPECT_EQ(squared_distance({a, b}, {c, d}), squared_distance({b, a}, {c, d}));
  }
}

TEST(Decimating, gives_the_same_bits_every_time) {
  const Groom groom = support::make_head_of_hair(200);
  const Grid grid = grid_of(groom, 7);
  StiffenerList a = springs_of(groom, grid), b = a;
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, 100, a));
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, 100, b));
  EXPECT_EQ(a.stiffness, b.stiffness);
  EXPECT_EQ(a.begin, b.begin);
}

TEST(Decimating, stops_when_told_to) {
  const Groom groom = support::make_head_of_hair(200);
  const Grid grid = grid_of(groom, 7);
  StiffenerList springs = springs_of(groom, grid);
  EXPECT_FALSE(decimate(grid, StiffenerKind::spring, 10, springs, [](double) { return false; }));
}

// The share is shown to people as a bar, and may not go backwards.
TEST(Decimating, reports_a_share_that_never_falls) {
  const Groom groom = support::make_head_of_hair(300);
  const Grid grid = grid_of(groom, 7);
  StiffenerList springs = springs_of(groom, grid);
  std::vector<double> shares;
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, 10, springs, [&](double share) {
    shares.push_back(share);
    return true;
  }));
  ASSERT_GE(shares.size(), 3u);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_GE(shares.front(), 0);
  EXPECT_EQ(shares.back(), 1);
}

TEST(Decimating, many_coincident_stiffeners_are_no_trouble) {
  const Grid grid = grid_of_cells(5);
  StiffenerList springs, attachments;
  // With so many stiffeners at one place, any step of the algorithm that is quadratic in their number does not end in
  // the time of a test.
  for (int i = 0; i < 100'000; ++i) {
    add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), {}, {}, springs);
    add_attachment(grid, Vec3(1, 1.3, 1.4), {}, {}, attachments);
  }
  const double k = total(attachments.stiffness);
  ASSERT_TRUE(decimate(grid, StiffenerKind::spring, 7, springs));
  ASSERT_TRUE(decimate(grid, StiffenerKind::attachment, 7, attachments));
  EXPECT_EQ(springs.count(), 7u);
  EXPECT_NEAR(total(attachments.stiffness), k, 1e-9 * k);
}

}  // namespace
}  // namespace hairnet
