#include "tests/load/fleet_plan/options.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace hairnet::fleet_plan {
namespace {

std::variant<Options, int> parse(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "hairnet-fleet-plan");
  return parse_options(static_cast<int>(arguments.size()), arguments.data());
}

TEST(FleetPlanOptions, flags_reach_the_settings_and_the_costs) {
  const auto parsed = parse({"--lease-s", "5", "--cores", "16", "--zipf", "1.2", "--level", "learnt", "--level-load-s",
                             "0.5", "--page", "plan.html", "--seed", "9"});
  const auto& options = std::get<Options>(parsed);
  EXPECT_EQ(options.settings.lease_s, 5);
  EXPECT_EQ(options.settings.cores, 16);
  EXPECT_EQ(options.settings.zipf, 1.2);
  EXPECT_EQ(options.settings.level, HairLevel::learnt);
  EXPECT_EQ(options.settings.costs.level_load_s, 0.5);
  EXPECT_EQ(options.settings.seed, 9u);
  EXPECT_EQ(options.page, "plan.html");
}

TEST(FleetPlanOptions, bad_flags_are_refused_in_one_line) {
  const std::vector<std::pair<std::vector<const char*>, std::string>> cases{
      {{"--peek", "5"}, "--peak"},        {{"--peak", "many"}, "--peak"},
      {{"--peak", "nan"}, "--peak"},      {{"--cores", "0"}, "--cores"},
      {{"--lease-s", "-1"}, "--lease-s"}, {{"--level", "fine"}, "--level"},
      {{"--rooms", "0"}, "--rooms"},      {{"--deploy-h", "0.01"}, "--deploy-h"},
      {{"--mtbf-h", "0.01"}, "--mtbf-h"}, {{"--peak", "1000000", "--days", "31", "--session-min", "1"}, "sessions"}};
  for (const auto& [arguments, named] : cases) {
    testing::internal::CaptureStderr();
    const auto parsed = parse(arguments);
    const std::string said = testing::internal::GetCapturedStderr();
    ASSERT_TRUE(std::holds_alternative<int>(parsed)) << arguments[0] << ' ' << arguments[1];
    EXPECT_EQ(std::get<int>(parsed), 2);
    EXPECT_NE(said.find(named), std::string::npos) << said;
    EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
  }
}

TEST(FleetPlanOptions, help_has_examples) {
  testing::internal::CaptureStdout();
  const auto parsed = parse({"--help"});
  const std::string help = testing::internal::GetCapturedStdout();
  EXPECT_EQ(std::get<int>(parsed), 0);
  EXPECT_NE(help.find("Examples:"), std::string::npos);
  for (const CostFigure& cost : cost_figures()) EXPECT_NE(help.find(cost.flag), std::string::npos);
}

}  // namespace
}  // namespace hairnet::fleet_plan
