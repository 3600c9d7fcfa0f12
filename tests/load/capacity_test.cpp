#include <gmock/gmock.h>

#include "tests/load/find_capacity.hpp"

namespace hairnet::load {
namespace {

// Probes until the search is over. `holds` returns whether the server passes with that many characters.
template <class Holds>
CapacitySearch search(const CapacitySearch::Limits& limits, Holds holds) {
  CapacitySearch search(limits);
  for (int i = 0; search.next() && i < 1000; ++i) search.report(holds(search.next()->characters));
  EXPECT_FALSE(search.next());
  return search;
}

TEST(CapacitySearch, finds_a_known_capacity_within_its_resolution) {
  for (const std::uint32_t known : {1u, 5u, 16u, 17u, 100u, 333u, 1000u, 4095u, 60'000u}) {
    CapacitySearch::Limits limits;
    const auto found = search(limits, [&](std::uint32_t n) { return n <= known; });
    EXPECT_LE(found.capacity(), known);
    // The answer may be 5 % too low (Limits::resolution), or one character.
    EXPECT_GE(found.capacity() + std::max(1.0, 0.05 * known), known) << known;
    EXPECT_TRUE(found.probes().back().confirms);
    // A search by doubling and bisection must end well before Limits::probe_count_max, which is 30.
    EXPECT_LE(found.probes().size(), 25u);
    EXPECT_FALSE(found.reached_max());
  }
}

TEST(CapacitySearch, keeps_to_whole_clients) {
  CapacitySearch::Limits limits;
  limits.granule = 24;
  const auto found = search(limits, [](std::uint32_t n) { return n <= 1000; });
  for (const auto& probe : found.probes()) EXPECT_EQ(probe.characters % 24, 0u);
  EXPECT_LE(found.capacity(), 1000u);
  // The largest multiple of 24 below 1000 is 984. The resolution of 5 % leaves out two more multiples at most.
  EXPECT_GE(found.capacity(), 936u);
}

TEST(CapacitySearch, ends_when_no_load_passes_or_every_load_passes) {
  EXPECT_EQ(search({}, [](std::uint32_t) { return false; }).capacity(), 0u);
  CapacitySearch::Limits limits;
  limits.most = 500;
  const auto all = search(limits, [](std::uint32_t) { return true; });
  EXPECT_EQ(all.capacity(), 500u);
  EXPECT_TRUE(all.reached_max());
}

TEST(CapacitySearch, load_that_passes_once_and_fails_later_is_not_the_answer) {
  // A load of 400 to 500 characters passes every other time only. The search must confirm its answer with a second
  // pass.
  int turn = 0;
  const auto found = search({}, [&](std::uint32_t n) { return n < 400 || (n <= 500 && turn++ % 2 == 0); });
  EXPECT_GT(found.capacity(), 0u);
  EXPECT_TRUE(found.probes().back().passed);
  EXPECT_TRUE(found.probes().back().confirms);
  EXPECT_LE(found.capacity(), 500u);
}

TEST(CapacitySearch, is_bounded_against_a_server_that_is_never_sure) {
  int turn = 0;
  const auto found = search({}, [&](std::uint32_t) { return turn++ % 2 == 0; });
  // Limits::probe_count_max is 30.
  EXPECT_LE(found.probes().size(), 30u);
}

Options capacity_options() {
  Options options;
  options.plan.stages = {parse_stage("steady:10s:clients=4,characters=8,level=low", nullptr).value()};
  options.capacity = CapacityOptions{};
  options.requirements = {parse_requirement("latency_p99_ms<50").value()};
  return options;
}

// Stands for a server whose latency is proportional to its characters, and for a generator that lags by 50 ms, beyond
// its limit, when there are more than `generator_limit` characters.
Prober fake_prober(double ms_per_character, double generator_limit) {
  return [=](const Plan& plan) -> Result<RunResult> {
    RunResult result;
    result.plan = plan;
    const Stage& stage = plan.stages.back();
    const double characters = stage.clients * stage.characters;
    result.generator_lag_p99_ms = characters > generator_limit ? 50 : 0.1;
    for (const Stage& each : plan.stages) {
      StageResult staged;
      staged.stage = each;
      staged.figures = {{"latency_p99_ms", characters * ms_per_character}, {"characters", characters}};
      result.stages.push_back(staged);
    }
    return result;
  };
}

TEST(FindCapacity, probes_with_warm_up_and_measured_part_and_confirms_longer) {
  const Options options = capacity_options();
  const Plan plan = probe_plan(options.plan, {96, false, false}, *options.capacity);
  ASSERT_EQ(plan.stages.size(), 2u);
  EXPECT_FALSE(plan.stages[0].measured);
  EXPECT_EQ(plan.stages[1].clients, 12u);
  EXPECT_EQ(plan.stages[1].characters, 8u);
  EXPECT_EQ(plan.stages[1].levels, std::vector{LevelIndex::low});
  EXPECT_DOUBLE_EQ(plan.stages[1].duration_s - plan.stages[1].warm_s, options.capacity->probe_s);
  const Plan confirming = probe_plan(options.plan, {96, true, false}, *options.capacity);
  EXPECT_DOUBLE_EQ(confirming.stages[1].duration_s - confirming.stages[1].warm_s, options.capacity->confirm_s);
}

TEST(FindCapacity, adds_characters_to_a_single_client) {
  Options options = capacity_options();
  options.plan.stages.back().clients = 1;
  const Plan plan = probe_plan(options.plan, {77, false, false}, *options.capacity);
  EXPECT_EQ(plan.stages[1].clients, 1u);
  EXPECT_EQ(plan.stages[1].characters, 77u);
}

TEST(FindCapacity, finds_where_the_threshold_fails) {
  Report report;
  ASSERT_TRUE(find_capacity(capacity_options(), fake_prober(0.1, 1e9), report));
  ASSERT_TRUE(report.capacity);
  // The latency reaches the threshold of 50 ms at 500 characters. The answer may be 5 % lower, in whole clients of
  // eight characters.
  EXPECT_LT(report.capacity->capacity, 500u);
  EXPECT_GE(report.capacity->capacity, 470u);
  EXPECT_FALSE(report.capacity->limited_by_generator);
  ASSERT_EQ(report.runs.size(), 1u);
  EXPECT_EQ(report.capacity->points.back().probe.characters, report.capacity->capacity);
  EXPECT_DOUBLE_EQ(report.runs[0].stages.back().figures.at("characters"), report.capacity->capacity);
}

TEST(FindCapacity, reports_when_the_generator_was_the_limit) {
  Report report;
  // The generator is late above 200 characters, long before the server reaches its threshold.
  ASSERT_TRUE(find_capacity(capacity_options(), fake_prober(0.1, 200), report));
  EXPECT_LE(report.capacity->capacity, 200u);
  EXPECT_TRUE(report.capacity->limited_by_generator);
}

TEST(FindCapacity, gives_up_when_a_run_is_impossible) {
  Report report;
  const auto found = find_capacity(
      capacity_options(), [](const Plan&) -> Result<RunResult> { return Refusal("no server"); }, report);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error(), "no server");
}

}  // namespace
}  // namespace hairnet::load
