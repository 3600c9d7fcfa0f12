#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <string>

#include "tests/whole/fleet_scenario.hpp"

namespace hairnet::whole {
namespace {

constexpr std::uint64_t kSeeds = HAIRNET_SANITIZED ? 12 : 60;

void run_seeds(std::uint64_t first, std::uint64_t count) {
  spdlog::set_level(spdlog::level::off);
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    SCOPED_TRACE("HAIRNET_SEED=" + std::to_string(seed));
    for (const std::string& fault : run_fleet_scenario(seed).faults) ADD_FAILURE() << fault;
  }
}

TEST(FleetSeeds, a_room_never_has_two_owners_and_has_one_again_after_all_faults) {
  if (const char* seed = std::getenv("HAIRNET_SEED")) return run_seeds(std::strtoull(seed, nullptr, 10), 1);
  run_seeds(1, kSeeds);
}

TEST(FleetSeeds, the_same_seed_comes_to_the_same_outcome) {
  spdlog::set_level(spdlog::level::off);
  for (std::uint64_t seed = 1; seed <= 8; ++seed)
    EXPECT_EQ(run_fleet_scenario(seed).hash, run_fleet_scenario(seed).hash) << "seed " << seed;
}

}  // namespace
}  // namespace hairnet::whole
