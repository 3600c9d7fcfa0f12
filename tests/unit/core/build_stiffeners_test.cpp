#include <gtest/gtest.h>

#include <numeric>

#include "core/levels/fit_lattice.hpp"
#include "core/levels/resample.hpp"
#include "core/levels/stiffener_list.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/support/case_name.hpp"

namespace hairnet {
namespace {

// The stiffnesses are those of one hair of the default Material; the damping time is about its own for hair of 30 cm.
constexpr double kAxial_n = 4e-4, kAttachment_n_per_m = 6e-3, kDampingTime_s = 0.008;

struct Built {
  Grid grid;
  StiffenerList springs, attachments;
};

Built stiffeners_of(const Groom& groom, int n) {
  Built built{Grid(fit_lattice(groom.points, {n, n, n})), {}, {}};
  std::vector<Vec3> polyline, cuts;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    polyline_on_grid(built.grid, groom.strand_points(s), polyline);
    if (arc_length(built.grid, polyline) < kLengthMin) continue;
    cut_points(built.grid, polyline, cuts);
    const double hair_count = groom.strands[s].hair_count;
    const std::uint16_t group = groom.strands[s].group;
    // A spring joins each two neighbouring cuts, where the strand passes from cell to cell.
    for (std::size_t i = 1; i < cuts.size(); ++i) {
      add_spring(built.grid, cuts[i - 1], cuts[i], hair_count * kAxial_n, kDampingTime_s, group, built.springs);
    }
    add_attachment(built.grid, polyline.front(), hair_count * kAttachment_n_per_m, kDampingTime_s, group,
                   built.attachments);
  }
  return built;
}

double weight_sum(const StiffenerList& list, std::size_t s) {
  double sum = 0;
  for (const auto& [node, weight] : list.weights(s)) sum += weight;
  return sum;
}

Vec3 weighted_nodes(const Built& built, const StiffenerList& list, std::size_t s) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [node, weight] : list.weights(s)) sum += weight * built.grid.node_head(node);
  return sum;
}

class Stiffening : public testing::TestWithParam<int> {};

TEST_P(Stiffening, weights_of_springs_sum_to_zero_and_of_attachments_to_one) {
  const Built built = stiffeners_of(support::make_odd_groom(), GetParam());
  ASSERT_GT(built.springs.count(), 40u);
  for (std::size_t s = 0; s < built.springs.count(); ++s) EXPECT_NEAR(weight_sum(built.springs, s), 0, 1e-12);
  for (std::size_t s = 0; s < built.attachments.count(); ++s) EXPECT_NEAR(weight_sum(built.attachments, s), 1, 1e-12);
}

TEST_P(Stiffening, nodes_ascend_and_no_weight_is_zero) {
  const Built built = stiffeners_of(support::make_odd_groom(), GetParam());
  for (const StiffenerList* list : {&built.springs, &built.attachments}) {
    for (std::size_t s = 0; s < list->count(); ++s) {
      const auto weights = list->weights(s);
      ASSERT_FALSE(weights.empty());
      // Each end of a stiffener may weigh on the eight nodes of its cell.
      EXPECT_LE(weights.size(), 16u);
      for (std::size_t e = 0; e < weights.size(); ++e) {
        EXPECT_NE(weights[e].weight, 0);
        if (e > 0) {
          EXPECT_LT(weights[e - 1].node, weights[e].node);
        }
      }
    }
  }
}

// A stiffener's rest is computed from its nodes. If the weights gave another place, hair would pull at rest.
TEST_P(Stiffening, weighted_nodes_give_the_chord_and_the_root_back) {
  const Built built = stiffeners_of(support::make_odd_groom(), GetParam());
  for (std::size_t s = 0; s < built.springs.count(); ++s) {
    const auto& [from, to] = built.springs.ends[s];
    EXPECT_NEAR((weighted_nodes(built, built.springs, s) - (built.grid.to_head(to) - built.grid.to_head(from))).norm(),
                0, 1e-12);
  }
  for (std::size_t s = 0; s < built.attachments.count(); ++s) {
    EXPECT_NEAR((weighted_nodes(built, built.attachments, s) - built.grid.to_head(built.attachments.ends[s][0])).norm(),
                0, 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(NodesAnAxis, Stiffening, testing::Values(3, 5, 7, 10), support::CaseName{"_nodes"});

TEST(Stiffening, springs_in_series_are_as_stiff_as_the_whole_strand) {
  Groom groom;
  support::add(groom, support::straight({0, 0, 0}, {1, -3, 0.5f}, 0.4f, 7), {.hair_count = 30});
  const Built built = stiffeners_of(groom, 10);
  ASSERT_GT(built.springs.count(), 5u);
  double compliance = 0;
  for (const double k : built.springs.stiffness) compliance += 1 / k;
  // A strand of 30 hairs and a length of 0.4 m has this stiffness as a whole.
  const double stiffness = 30 * kAxial_n / 0.4;
  EXPECT_NEAR(1 / compliance, stiffness, 1e-5 * stiffness);
}

TEST(Stiffening, damping_is_stiffness_times_the_time_constant) {
  const Built built = stiffeners_of(support::make_head_of_hair(10), 6);
  for (std::size_t s = 0; s < built.springs.count(); ++s) {
    EXPECT_NEAR(built.springs.damping[s] / built.springs.stiffness[s], kDampingTime_s, 1e-9);
  }
  for (std::size_t s = 0; s < built.attachments.count(); ++s) {
    // Each strand of make_head_of_hair() stands for 20 hairs.
    EXPECT_NEAR(built.attachments.stiffness[s], 20 * kAttachment_n_per_m, 1e-9);
    EXPECT_NEAR(built.attachments.damping[s] / built.attachments.stiffness[s], kDampingTime_s, 1e-9);
  }
}

TEST(Stiffening, a_short_strand_is_no_stiffer_than_a_tenth_of_a_cell) {
  Lattice lattice;
  lattice.dims = {4, 4, 4};
  const Grid grid(lattice);
  StiffenerList springs;
  // The chord is 1 mm long in cells of 1 m, so the length that counts is a tenth of a metre.
  add_spring(grid, Vec3(1.5, 1.5, 1.5), Vec3(1.501, 1.5, 1.5), kAxial_n, kDampingTime_s, 0, springs);
  ASSERT_EQ(springs.count(), 1u);
  EXPECT_NEAR(springs.stiffness[0], kAxial_n / 0.1, 1e-9);
}

TEST(Stiffening, a_chord_without_length_gives_no_spring) {
  Lattice lattice;
  lattice.dims = {4, 4, 4};
  StiffenerList springs;
  add_spring(Grid(lattice), Vec3(1.5, 1.5, 1.5), Vec3(1.5, 1.5, 1.5), kAxial_n, kDampingTime_s, 0, springs);
  // A chord of 5 micrometres is below kLengthMin = 1e-5 m.
  add_spring(Grid(lattice), Vec3(1.5, 1.5, 1.5), Vec3(1.5 + 5e-6, 1.5, 1.5), kAxial_n, kDampingTime_s, 0, springs);
  EXPECT_EQ(springs.count(), 0u);
  EXPECT_TRUE(springs.entries.empty());
}

TEST(Stiffening, a_stiffness_that_float_cannot_store_gives_no_stiffener) {
  Lattice lattice;
  lattice.dims = {4, 4, 4};
  const Grid grid(lattice);
  StiffenerList list;
  add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), 1e-40, kDampingTime_s, 0, list);
  add_attachment(grid, Vec3(1, 1.3, 1.4), 1e-40, kDampingTime_s, 0, list);
  EXPECT_EQ(list.count(), 0u);
  add_spring(grid, Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), 1e-30, kDampingTime_s, 0, list);
  EXPECT_EQ(list.count(), 1u);
}

TEST(StiffenerListDeathTest, asserts_that_a_list_is_not_appended_to_itself) {
  StiffenerList list;
  EXPECT_DEATH(append(list, list), "&more != &list");
}

TEST(Stiffening, a_spring_across_a_cell_has_eight_nodes) {
  Lattice lattice;
  lattice.dims = {4, 4, 4};
  StiffenerList springs;
  add_spring(Grid(lattice), Vec3(1, 1.3, 1.4), Vec3(2, 1.6, 1.7), kAxial_n, kDampingTime_s, 0, springs);
  ASSERT_EQ(springs.count(), 1u);
  EXPECT_EQ(springs.weights(0).size(), 8u);
}

}  // namespace
}  // namespace hairnet
