#include "core/build/decimate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "core/build/nearest_ends.hpp"
#include "tests/unit/core/build_grooms.hpp"
#include "tests/unit/core/build_lists.hpp"

namespace hairnet {
namespace {

using support::attachments_of;
using support::dense;
using support::grid_of;
using support::springs_of;
using support::weight_matrix;

Grid unit_grid(int n) {
  Lattice lattice;
  lattice.dims = {n, n, n};
  return Grid(lattice);
}

double total(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

std::map<std::uint16_t, double> stiffness_by_group(const StiffenerList& list) {
  std::map<std::uint16_t, double> sums;
  for (std::size_t s = 0; s < list.count(); ++s) sums[list.group[s]] += list.stiffness[s];
  return sums;
}

// Fig. 7 word for word: of all pairs of a group that share a node, the cheapest, again and again.
void decimate_all_pairs(StiffenerKind kind, std::size_t count, std::vector<Eigen::VectorXd>& w, std::vector<double>& k,
                        const std::vector<std::uint16_t>& group) {
  std::vector<bool> is_there(w.size(), true);
  for (std::size_t left = w.size(); left > count; --left) {
    double least = std::numeric_limits<double>::infinity();
    std::size_t kept = 0, merged = 0;
    for (std::size_t a = 0; a < w.size(); ++a) {
      for (std::size_t b = 0; b < w.size(); ++b) {
        if (a == b || !is_there[a] || !is_there[b] || group[a] != group[b]) continue;
        const double dot = w[a].dot(w[b]);
        if (dot == 0) continue;
        const double cost = merge_of(kind, k[b], w[a].squaredNorm(), w[b].squaredNorm(), dot).cost;
        if (cost < least) {
          least = cost;
          kept = a;
          merged = b;
        }
      }
    }
    ASSERT_TRUE(std::isfinite(least));
    k[kept] += merge_of(kind, k[merged], w[kept].squaredNorm(), w[merged].squaredNorm(), w[kept].dot(w[merged])).gain;
    k[merged] = 0;
    is_there[merged] = false;
  }
}

class CostFormula : public testing::TestWithParam<StiffenerKind> {};

TEST_P(CostFormula, cost_is_the_squared_frobenius_norm_of_what_changes) {
  const Groom groom = support::make_head_of_hair(12);
  const Grid grid = grid_of(groom, 4);
  const StiffenerList list =
      GetParam() == StiffenerKind::spring ? springs_of(groom, grid) : attachments_of(groom, grid);
  for (std::size_t a = 0; a < list.count(); ++a) {
    for (std::size_t b = 0; b < list.count(); ++b) {
      if (a == b) continue;
      const Eigen::VectorXd wa = dense(list, a, grid.node_count()), wb = dense(list, b, grid.node_count());
      const Merge merge = merge_of(GetParam(), list.stiffness[b], wa.squaredNorm(), wb.squaredNorm(), wa.dot(wb));
      const Eigen::MatrixXd change = list.stiffness[b] * wb * wb.transpose() - merge.gain * wa * wa.transpose();
      const double scale = std::pow(list.stiffness[b] * (wa.squaredNorm() + wb.squaredNorm()), 2);
      EXPECT_NEAR(merge.cost, change.squaredNorm(), 1e-12 * scale);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, CostFormula, testing::Values(StiffenerKind::spring, StiffenerKind::attachment));

TEST(CostFormula, the_gain_of_a_spring_makes_the_cost_least) {
  const double k = 3, kept = 1.2, merged = 0.9, dot = 0.7;
  const Merge best = merge_of(StiffenerKind::spring, k, kept, merged, dot);
  EXPECT_NEAR(best.gain, k * dot * dot / (kept * kept), 1e-12);
  EXPECT_NEAR(best.cost, k * k * (merged * merged - std::pow(dot, 4) / (kept * kept)), 1e-12);
  for (const double off : {-0.1, -0.01, 0.01, 0.1}) {
    const double gain = best.gain + off;
    EXPECT_GT(k * k * merged * merged - 2 * k * gain * dot * dot + gain * gain * kept * kept, best.cost);
  }
}

class Decimating : public testing::TestWithParam<std::size_t> {};

TEST_P(Decimating, leaves_exactly_the_count_asked_for) {
  const Groom groom = support::make_head_of_hair(300);
  const Grid grid = grid_of(groom, 7);
  StiffenerList springs = springs_of(groom, grid), attachments = attachments_of(groom, grid);
  ASSERT_GT(springs.count(), GetParam());
  ASSERT_TRUE(decimate(StiffenerKind::spring, GetParam(), springs));
  ASSERT_TRUE(decimate(StiffenerKind::attachment, std::min<std::size_t>(GetParam(), 200), attachments));
  EXPECT_EQ(springs.count(), GetParam());
  EXPECT_EQ(attachments.count(), std::min<std::size_t>(GetParam(), 200));
  EXPECT_EQ(springs.begin.size(), springs.count() + 1);
  EXPECT_EQ(springs.begin.back(), springs.entries.size());
  EXPECT_EQ(springs.damping.size(), springs.count());
  EXPECT_EQ(springs.group.size(), springs.count());
  EXPECT_EQ(springs.ends.size(), springs.count());
}

INSTANTIATE_TEST_SUITE_P(Counts, Decimating, testing::Values(0, 1, 2, 3, 17, 100, 800));

TEST(Decimating, keeps_all_there_are_when_asked_for_more) {
  const Groom groom = support::make_head_of_hair(20);
  const StiffenerList before = springs_of(groom, grid_of(groom, 5));
  StiffenerList after = before;
  ASSERT_TRUE(decimate(StiffenerKind::spring, before.count(), after));
  EXPECT_EQ(after.stiffness, before.stiffness);
  ASSERT_TRUE(decimate(StiffenerKind::spring, 100'000, after));
  EXPECT_EQ(after.stiffness, before.stiffness);
}

TEST(Decimating, an_empty_list_stays_empty) {
  StiffenerList list;
  EXPECT_TRUE(decimate(StiffenerKind::spring, 10, list));
  EXPECT_TRUE(decimate(StiffenerKind::attachment, 0, list));
  EXPECT_EQ(list.count(), 0u);
}

TEST(Decimating, identical_springs_merge_exactly) {
  const Grid grid = unit_grid(4);
  StiffenerList springs;
  for (int i = 0; i < 50; ++i) {
    add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), {}, {}, springs);
    add_spring(grid, Vec3(2, 1.6, 1.7), Vec3(1, 1.3, 1.4), {}, {}, springs);  // the other way round
  }
  const Eigen::MatrixXd before = weight_matrix(springs, grid.node_count());
  const double k = total(springs.stiffness), q = total(springs.damping);
  ASSERT_TRUE(decimate(StiffenerKind::spring, 1, springs));
  EXPECT_NEAR(springs.stiffness[0], k, 1e-10 * k);
  EXPECT_NEAR(springs.damping[0], q, 1e-10 * q);
  EXPECT_NEAR((weight_matrix(springs, grid.node_count()) - before).norm(), 0, 1e-10 * before.norm());
}

TEST(Decimating, two_bundles_of_identical_springs_become_two_springs_without_any_error) {
  const Grid grid = unit_grid(5);
  StiffenerList springs;
  for (int i = 0; i < 40; ++i) {
    add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), {}, {}, springs);
    add_spring(grid, Vec3(1.2, 2, 1.4), Vec3(1.5, 1, 1.7), {}, {}, springs);
  }
  const Eigen::MatrixXd before = weight_matrix(springs, grid.node_count());
  ASSERT_TRUE(decimate(StiffenerKind::spring, 2, springs));
  EXPECT_NEAR((weight_matrix(springs, grid.node_count()) - before).norm(), 0, 1e-10 * before.norm());
}

TEST(Decimating, attachments_keep_their_total_hold_in_each_group) {
  const Groom groom = support::make_head_of_hair(300);
  StiffenerList attachments = attachments_of(groom, grid_of(groom, 10));
  const auto before = stiffness_by_group(attachments);
  for (const std::size_t count : {200, 50, 10, 2}) {
    ASSERT_TRUE(decimate(StiffenerKind::attachment, count, attachments));
    const auto after = stiffness_by_group(attachments);
    ASSERT_EQ(after.size(), before.size());
    for (const auto& [group, k] : before) EXPECT_NEAR(after.at(group), k, 1e-9 * k);
  }
}

TEST(Decimating, attachments_far_apart_merge_into_the_nearest) {
  const Grid grid = unit_grid(12);
  StiffenerList attachments;
  for (const double x : {1.5, 4.0, 9.5}) add_attachment(grid, Vec3(x, 2.5, 2.5), {}, {}, attachments);
  ASSERT_TRUE(decimate(StiffenerKind::attachment, 2, attachments));
  ASSERT_EQ(attachments.count(), 2u);
  EXPECT_NEAR(attachments.stiffness[0], 2 * attachments.stiffness[1], 1e-12);
  EXPECT_EQ(attachments.ends[1][0].x(), 9.5);
}

TEST(Decimating, springs_never_gain_from_another_group) {
  const Grid grid = unit_grid(4);
  StiffenerList springs;
  for (int i = 0; i < 20; ++i) {
    add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), {.hair_count = 1, .group = 0}, {}, springs);
    add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), {.hair_count = 5, .group = 1}, {}, springs);
  }
  const auto before = stiffness_by_group(springs);
  ASSERT_TRUE(decimate(StiffenerKind::spring, 2, springs));
  const auto after = stiffness_by_group(springs);
  ASSERT_EQ(after.size(), 2u);
  for (const auto& [group, k] : before) EXPECT_NEAR(after.at(group), k, 1e-10 * k);
}

TEST(Decimating, springs_that_share_no_node_lose_the_least_one) {
  const Grid grid = unit_grid(12);
  StiffenerList springs;
  const float hair_counts[] = {3, 1, 2, 5};
  for (int i = 0; i < 4; ++i) {
    add_spring(grid, Vec3(3 * i, 1.3, 1.4), Vec3(3 * i + 1, 1.6, 1.7), {.hair_count = hair_counts[i]}, {}, springs);
  }
  const std::vector<double> k = springs.stiffness;
  ASSERT_TRUE(decimate(StiffenerKind::spring, 2, springs));
  EXPECT_EQ(springs.stiffness, (std::vector<double>{k[0], k[3]}));
}

TEST(Decimating, overlapping_pairs_far_down_the_list_of_neighbours_are_found) {
  // Thirty crossing springs, nearest by their ends, that are orthogonal to the two that overlap.
  const Grid grid = unit_grid(12);
  StiffenerList springs;
  for (int i = 0; i < 30; ++i) {
    const Vec3 at(2 * (i % 5), 2 * (i / 5 % 5), 4 * (i / 25) + 4);
    add_spring(grid, at, at + Vec3(1, 0, 0), {.hair_count = 1}, {}, springs);
  }
  add_spring(grid, Vec3(0, 10, 0), Vec3(1, 10, 0), {.hair_count = 100}, {}, springs);
  add_spring(grid, Vec3(0, 10, 0), Vec3(0, 11, 10), {.hair_count = 1000}, {}, springs);
  const std::size_t count = springs.count();
  ASSERT_TRUE(decimate(StiffenerKind::spring, count - 1, springs));
  // The merge, and not the dropping of a weak one.
  EXPECT_EQ(std::ranges::count_if(springs.ends, [](const auto& ends) { return ends[0].z() >= 4; }), 30);
}

TEST(Decimating, is_as_good_as_looking_at_all_pairs) {
  const Groom groom = support::make_head_of_hair(60);
  const Grid grid = grid_of(groom, 4);
  for (const StiffenerKind kind : {StiffenerKind::spring, StiffenerKind::attachment}) {
    StiffenerList list = kind == StiffenerKind::spring ? springs_of(groom, grid) : attachments_of(groom, grid);
    const Eigen::MatrixXd before = weight_matrix(list, grid.node_count());
    std::vector<Eigen::VectorXd> w;
    for (std::size_t s = 0; s < list.count(); ++s) w.push_back(dense(list, s, grid.node_count()));
    std::vector<double> k = list.stiffness;
    const std::size_t count = list.count() / 4;
    decimate_all_pairs(kind, count, w, k, list.group);
    Eigen::MatrixXd all_pairs = Eigen::MatrixXd::Zero(before.rows(), before.cols());
    for (std::size_t s = 0; s < w.size(); ++s) all_pairs += k[s] * w[s] * w[s].transpose();

    ASSERT_TRUE(decimate(kind, count, list));
    const double error = (weight_matrix(list, grid.node_count()) - before).norm();
    EXPECT_LE(error, 1.15 * (all_pairs - before).norm());
    EXPECT_LT(error, before.norm());
  }
}

TEST(Decimating, springs_never_grow_stiffer_in_all) {
  // A gain is a projection, k_b (w_a.w_b)^2 / |w_a|^2 <= k_b |w_b|^2: the trace of the sum of k w w^T never grows.
  const Groom groom = support::make_head_of_hair(200);
  const Grid grid = grid_of(groom, 7);
  StiffenerList springs = springs_of(groom, grid);
  double trace = weight_matrix(springs, grid.node_count()).trace();
  for (const std::size_t count : {800, 200, 100, 10}) {
    ASSERT_TRUE(decimate(StiffenerKind::spring, count, springs));
    const double less = weight_matrix(springs, grid.node_count()).trace();
    EXPECT_LT(less, trace);
    EXPECT_GT(less, 0.1 * trace);
    trace = less;
  }
}

TEST(Decimating, springs_along_one_line_compare_alike_whichever_way_they_run) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> range(0, 5);
  const auto vec = [&] {
    const double x = range(random), y = range(random), z = range(random);
    return Vec3(x, y, z);
  };
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 a = vec(), b = vec();
    EXPECT_EQ(ordered_ends({a, b}), ordered_ends({b, a}));
  }
}

TEST(Decimating, gives_the_same_bits_every_time) {
  const Groom groom = support::make_head_of_hair(200);
  StiffenerList a = springs_of(groom, grid_of(groom, 7)), b = a;
  ASSERT_TRUE(decimate(StiffenerKind::spring, 100, a));
  ASSERT_TRUE(decimate(StiffenerKind::spring, 100, b));
  EXPECT_EQ(a.stiffness, b.stiffness);
  EXPECT_EQ(a.begin, b.begin);
}

TEST(Decimating, stops_when_told_to) {
  const Groom groom = support::make_head_of_hair(200);
  StiffenerList springs = springs_of(groom, grid_of(groom, 7));
  EXPECT_FALSE(decimate(StiffenerKind::spring, 10, springs, [](double) { return false; }));
}

TEST(Decimating, reports_a_share_that_never_falls) {
  const Groom groom = support::make_head_of_hair(300);
  StiffenerList springs = springs_of(groom, grid_of(groom, 7));
  std::vector<double> shares;
  ASSERT_TRUE(decimate(StiffenerKind::spring, 10, springs, [&](double share) {
    shares.push_back(share);
    return true;
  }));
  ASSERT_GE(shares.size(), 3u);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_GE(shares.front(), 0);
  EXPECT_EQ(shares.back(), 1);
}

TEST(Decimating, many_coincident_stiffeners_are_no_trouble) {
  const Grid grid = unit_grid(5);
  StiffenerList springs, attachments;
  for (int i = 0; i < 100'000; ++i) {  // hangs where any step is quadratic in them
    add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), {}, {}, springs);
    add_attachment(grid, Vec3(1, 1.3, 1.4), {}, {}, attachments);
  }
  const double k = total(attachments.stiffness);
  ASSERT_TRUE(decimate(StiffenerKind::spring, 7, springs));
  ASSERT_TRUE(decimate(StiffenerKind::attachment, 7, attachments));
  EXPECT_EQ(springs.count(), 7u);
  EXPECT_NEAR(total(attachments.stiffness), k, 1e-9 * k);
}

}  // namespace
}  // namespace hairnet
