#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <string>

#include "tests/whole/scenario.hpp"

namespace hairnet::whole {
namespace {

constexpr std::uint64_t kSeeds = HAIRNET_SANITIZED ? 25 : 150;

void run_seeds(std::uint64_t first, std::uint64_t count) {
  spdlog::set_level(spdlog::level::off);
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    SCOPED_TRACE("HAIRNET_SEED=" + std::to_string(seed));
    const Outcome outcome = run_scenario(seed);
    for (const std::string& fault : outcome.faults) ADD_FAILURE() << fault;
  }
}

TEST(WholeSeeds, whatever_befalls_them_a_server_and_its_clients_are_well_afterwards) {
  if (const char* seed = std::getenv("HAIRNET_SEED")) return run_seeds(std::strtoull(seed, nullptr, 10), 1);
  run_seeds(1, kSeeds);
}

TEST(WholeSeeds, the_same_seed_comes_to_the_same_outcome) {
  spdlog::set_level(spdlog::level::off);
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Outcome first = run_scenario(seed), second = run_scenario(seed);
    // The folder of built levels outlives a scenario, so a later one finds more in it.
    for (Outcome* outcome : {&first, &second})
      std::erase_if(outcome->events, [](const auto& event) { return event.first.starts_with("server: level_cache"); });
    EXPECT_EQ(first.hash, second.hash) << "seed " << seed;
    EXPECT_EQ(first.events, second.events) << "seed " << seed;
  }
}

}  // namespace
}  // namespace hairnet::whole
