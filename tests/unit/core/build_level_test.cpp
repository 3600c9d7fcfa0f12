#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>
#include <thread>

#include "core/levels/build.hpp"
#include "core/levels/stiffener_order.hpp"
#include "core/number_range.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/equal_levels.hpp"
#include "tests/unit/core/level_checks.hpp"

namespace hairnet {
namespace {

using support::expect_valid;

Groom groom_with_body(Groom groom) {
  groom.body = support::make_plain_body();
  return groom;
}

class BuildLevel : public testing::TestWithParam<support::Named<LevelSpec>> {};

std::vector<support::Named<LevelSpec>> level_specs() {
  std::vector<support::Named<LevelSpec>> specs;
  for (std::size_t l = 0; l < kLevelSpecs.size(); ++l) specs.push_back({kLevelNames[l], kLevelSpecs[l]});
  return specs;
}

TEST_P(BuildLevel, odd_strands_give_a_valid_level) {
  const Groom groom = groom_with_body(support::make_odd_groom());
  ASSERT_EQ(validate(groom), "");
  LevelReport report;
  const auto level = build_level(groom, GetParam().value, {}, &report);
  expect_valid(*level);
  // The four are the empty strand, the single point, the coincident points and the strand of hardly any length in
  // make_odd_groom().
  EXPECT_EQ(report.degenerate_strands, 4u);
  EXPECT_EQ(report.active_nodes, level->rest.size());
  EXPECT_EQ(report.springs_after, level->springs.count());
  EXPECT_EQ(report.attachments_after, level->attachments.count());
  EXPECT_EQ(report.springs_after, std::min(report.springs_before, GetParam().value.spring_count));
  EXPECT_EQ(report.attachments_after, std::min(report.attachments_before, GetParam().value.attachment_count));
  EXPECT_GT(report.contacts, 0u);
}

TEST_P(BuildLevel, each_odd_strand_alone_gives_a_valid_level) {
  const Groom all = support::make_odd_groom();
  // The odd strands come after 40 ordinary ones (make_odd_groom), of which the last ten are built too.
  for (std::size_t s = 30; s < all.strand_count(); ++s) {
    if (all.strand_points(s).empty()) continue;
    SCOPED_TRACE(s);
    Groom groom;
    support::add(groom, {all.strand_points(s).begin(), all.strand_points(s).end()}, all.strands[s]);
    expect_valid(*build_level(groom, GetParam().value));
  }
}

// A point that only trimmed nodes move would not move by itself.
TEST_P(BuildLevel, every_groom_point_has_its_nodes_active) {
  const Groom groom = support::make_odd_groom();
  const auto level = build_level(groom, GetParam().value);
  const Lattice& lattice = level->geometry.lattice;
  for (const Vec3f& point : groom.points) {
    const Vec3f at = (point - lattice.origin).cwiseQuotient(lattice.spacing);
    const std::uint32_t nearest =
        lattice.index(static_cast<int>(std::lround(at[0])), static_cast<int>(std::lround(at[1])),
                      static_cast<int>(std::lround(at[2])));
    EXPECT_TRUE(std::ranges::binary_search(level->geometry.active_nodes, nearest));
  }
}

TEST_P(BuildLevel, unrooted_strands_have_no_attachment) {
  Groom groom = support::make_head_of_hair(30);
  for (StrandProperties& strand : groom.strands) strand.rooted = false;
  LevelReport report;
  const auto level = build_level(groom, GetParam().value, {}, &report);
  EXPECT_EQ(report.attachments_before, 0u);
  EXPECT_EQ(level->attachments.count(), 0u);
  expect_valid(*level);
}

TEST_P(BuildLevel, rest_positions_are_the_lattices_nodes) {
  const auto level = build_level(support::make_head_of_hair(30), GetParam().value);
  for (std::size_t i = 0; i < level->rest.size(); ++i) {
    EXPECT_EQ(level->rest[i], level->geometry.lattice.node(level->geometry.active_nodes[i]));
  }
}

TEST_P(BuildLevel, stiffeners_come_in_the_order_of_their_nodes) {
  const auto level = build_level(support::make_odd_groom(), GetParam().value);
  for (const Stiffeners* list : {&level->springs, &level->attachments}) {
    const auto nodes = [&](std::size_t s) {
      return std::span(list->nodes).subspan(list->begin[s], list->begin[s + 1] - list->begin[s]);
    };
    for (std::size_t s = 1; s < list->count(); ++s) {
      EXPECT_FALSE(std::ranges::lexicographical_compare(nodes(s), nodes(s - 1))) << "stiffener " << s;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Levels, BuildLevel, testing::ValuesIn(level_specs()), support::CaseName());

// Each stiffener carries its number as weight, stiffness, damping and rest, so that a mixed-up law shows. The first and
// the fourth have equal nodes and must keep their order.
TEST(StiffenerOrder, each_stiffener_keeps_its_law_and_equal_nodes_their_order) {
  Stiffeners list;
  const std::vector<std::vector<std::uint16_t>> nodes{{4, 5}, {1, 7, 9}, {1, 7}, {4, 5}, {0, 9}};
  for (std::size_t s = 0; s < nodes.size(); ++s) {
    const auto label = static_cast<float>(s);
    list.nodes.insert(list.nodes.end(), nodes[s].begin(), nodes[s].end());
    list.weights.insert(list.weights.end(), nodes[s].size(), label);
    list.begin.push_back(static_cast<std::uint32_t>(list.nodes.size()));
    list.stiffness.push_back(label);
    list.damping.push_back(10 * label);
    list.rest.push_back(Vec3f::Constant(100 * label));
  }
  order_by_nodes(list);
  EXPECT_EQ(list.nodes, (std::vector<std::uint16_t>{0, 9, 1, 7, 1, 7, 9, 4, 5, 4, 5}));
  EXPECT_EQ(list.begin, (std::vector<std::uint32_t>{0, 2, 4, 7, 9, 11}));
  EXPECT_EQ(list.weights, (std::vector<float>{4, 4, 2, 2, 1, 1, 1, 0, 0, 3, 3}));
  EXPECT_EQ(list.stiffness, (std::vector<float>{4, 2, 1, 0, 3}));
  EXPECT_EQ(list.damping, (std::vector<float>{40, 20, 10, 0, 30}));
  for (std::size_t s = 0; s < list.count(); ++s) EXPECT_EQ(list.rest[s], Vec3f::Constant(100 * list.stiffness[s]));
}

// Every second strand stands for a thousandth of a hair, and the material has almost no stiffness
// (NumberRange::kSmallest = 1e-12). Their products leave the normal numbers of a float, and still all stiffeners must
// be valid.
TEST(BuildLevels, weak_hair_beside_strong_hair_gives_finite_stiffeners) {
  Groom groom = support::make_head_of_hair(400);
  for (std::size_t s = 0; s < groom.strand_count(); s += 2) groom.strands[s].hair_count = 1e-3f;
  groom.materials.base.axial_stiffness_n = groom.materials.base.attachment_stiffness_n_per_m =
      static_cast<float>(1.01 * NumberRange::kSmallest);
  ASSERT_EQ(validate(groom), "");
  const auto set = build_levels(groom);
  for (const Level& level : set->levels) EXPECT_EQ(validate(level), "");
}

TEST(BuildLevelsDeathTest, asserts_that_the_groom_has_a_point) {
  EXPECT_DEATH(build_level({}, kLevelSpecs[2]), "!groom.points.empty\\(\\)");
}

TEST(BuildLevels, total_mass_and_drag_are_equal_at_every_level) {
  const Groom groom = support::make_odd_groom();
  const auto set = build_levels(groom);
  const double hair_kg = support::hair_length(groom) * static_cast<double>(Material{}.linear_density_kg_per_m);
  // Drag acts across a hair, in two directions, so the trace of its matrix is twice the drag of one.
  const double drag = 2 * support::hair_length(groom) * static_cast<double>(Material{}.air_drag_ns_per_m2);
  for (const Level& level : set->levels) {
    double mass = 0, trace = 0;
    for (const float m : level.mass) mass += static_cast<double>(m);
    for (const auto& q : level.drag) trace += static_cast<double>(q[0] + q[3] + q[5]);
    // The ether has half of the hair's mass (Material::ether_mass_ratio) on top of it.
    EXPECT_NEAR(mass, 1.5 * hair_kg, 1e-5 * hair_kg);
    EXPECT_NEAR(trace, drag, 1e-5 * drag);
  }
}

TEST(BuildLevels, are_those_that_build_level_gives) {
  const Groom groom = groom_with_body(support::make_odd_groom());
  const auto set = build_levels(groom);
  for (std::size_t i = 0; i < kLevelSpecs.size(); ++i) {
    const auto one = build_level(groom, kLevelSpecs[i]);
    EXPECT_EQ(set->levels[i].mass, one->mass);
    EXPECT_EQ(set->levels[i].springs.stiffness, one->springs.stiffness);
    EXPECT_EQ(set->levels[i].springs.weights, one->springs.weights);
    EXPECT_EQ(set->levels[i].geometry.trimmed_weights, one->geometry.trimmed_weights);
    ASSERT_EQ(set->levels[i].skin->size(), one->skin->size());
    EXPECT_EQ(set->levels[i].contacts.limit, one->contacts.limit);
    for (std::size_t b = 0; b < one->skin->size(); ++b) {
      EXPECT_EQ((*set->levels[i].skin)[b].distance, (*one->skin)[b].distance);
    }
  }
}

// The fraction is shown to people as a bar.
TEST(BuildLevels, progress_never_falls_and_ends_at_one) {
  std::vector<double> fractions;
  BuildCallbacks observer;
  observer.progress = [&](double fraction, std::string_view stage) {
    EXPECT_FALSE(stage.empty());
    fractions.push_back(fraction);
    return true;
  };
  ASSERT_TRUE(build_levels(groom_with_body(support::make_head_of_hair(400)), observer));
  EXPECT_TRUE(std::ranges::is_sorted(fractions));
  EXPECT_GE(fractions.front(), 0);
  EXPECT_EQ(fractions.back(), 1);
}

// Cancels a build at each of its calls. The rows of the skin make most of the calls, so only every 101st of them is
// tried.
TEST(BuildLevels, can_be_cancelled_at_every_call) {
  constexpr std::size_t kRowsApart = 101;
  const Groom groom = groom_with_body(support::make_head_of_hair(60));
  std::vector<std::string> stages;
  BuildCallbacks observer;
  observer.progress = [&](double, std::string_view stage) {
    stages.emplace_back(stage);
    return true;
  };
  ASSERT_TRUE(build_levels(groom, observer));
  for (std::size_t stop = 1; stop <= stages.size(); ++stop) {
    if (stages[stop - 1] == "measuring the skin" && stop % kRowsApart != 1) continue;
    std::size_t calls = 0;
    observer.progress = [&](double, std::string_view) { return ++calls < stop; };
    EXPECT_FALSE(build_levels(groom, observer));
    // A build that was cancelled does not call again.
    EXPECT_EQ(calls, stop);
  }
}

// Runs each loop on its own threads.
ParallelFor on_threads(std::size_t thread_count) {
  return [thread_count](std::size_t count, const std::function<void(std::size_t)>& body) {
    std::atomic<std::size_t> next = 0;
    std::vector<std::thread> threads;
    for (std::size_t t = 0; t < thread_count; ++t) {
      threads.emplace_back([&] {
        for (std::size_t i = next++; i < count; i = next++) body(i);
      });
    }
    for (std::thread& thread : threads) thread.join();
  };
}

void last_first(std::size_t count, const std::function<void(std::size_t)>& body) {
  while (count > 0) body(--count);
}

TEST(BuildLevels, any_number_of_threads_and_any_order_give_the_same_bits) {
  const Groom groom = groom_with_body(support::make_head_of_hair(1500));
  const auto alone = build_levels(groom);
  for (const ParallelFor& parallel_for : {on_threads(2), on_threads(5), ParallelFor(last_first)}) {
    support::expect_equal(*alone, *build_levels(groom, {}, nullptr, parallel_for));
  }
}

// The build serialises its calls of `progress`, so that callers need no lock, and none may come once the caller has
// said stop.
TEST(BuildLevels, threads_ask_one_at_a_time_and_not_again_once_cancelled) {
  const Groom groom = groom_with_body(support::make_head_of_hair(200));
  for (const int stop : {1, 2, 9, 30}) {
    std::atomic<int> asking = 0;
    int calls = 0;
    double last = 0;
    BuildCallbacks observer;
    observer.progress = [&](double fraction, std::string_view) {
      EXPECT_EQ(++asking, 1);
      EXPECT_GE(fraction, last);
      last = fraction;
      --asking;
      return ++calls < stop;
    };
    EXPECT_FALSE(build_levels(groom, observer, nullptr, on_threads(4)));
    EXPECT_EQ(calls, stop);
  }
}

TEST(BuildLevels, report_gives_the_callers_time) {
  double now_s = 0;
  BuildCallbacks observer;
  observer.clock_s = [&] { return now_s += 1; };
  std::array<LevelReport, 4> reports;
  ASSERT_TRUE(build_levels(support::make_head_of_hair(20), observer, &reports));
  for (const LevelReport& report : reports) {
    // The clock advances by one second with each reading. Decimation lies between two readings, and a whole level
    // between four.
    EXPECT_EQ(report.decimation_s, 1);
    EXPECT_EQ(report.total_s, 3);
  }
}

// A stiffener of stiffness 0 would do nothing but cost time, and divisions by it would give NaN.
TEST(BuildLevels, materials_without_stiffness_give_levels_of_ether_alone) {
  Groom groom = support::make_odd_groom();
  Material& material = groom.materials.base;
  material.axial_stiffness_n = 0;
  material.attachment_stiffness_n_per_m = 0;
  material.air_drag_ns_per_m2 = 0;
  const auto set = build_levels(groom);
  for (const Level& level : set->levels) {
    EXPECT_EQ(level.springs.count(), 0u);
    expect_valid(level);
  }
}

// A coordinate may be 10 m (GroomLimits::coordinate_max_m).
TEST(BuildLevels, the_coordinates_farthest_apart_that_a_groom_may_have_are_no_trouble) {
  Groom groom;
  support::add(groom, {{-10, -10, -10}, {10, 10, 10}});
  support::add(groom, {{10, -10, 10}, {-10, 10, -10}, {0, 0, 0}});
  support::add(groom, {{9.999f, 10, 10}, {10, 10, 10}});
  ASSERT_EQ(validate(groom), "");
  const auto set = build_levels(groom);
  for (const Level& level : set->levels) expect_valid(level);
}

}  // namespace
}  // namespace hairnet
