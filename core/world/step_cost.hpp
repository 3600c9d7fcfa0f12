#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/assert.hpp"
#include "core/levels/level.hpp"
#include "core/world/step_plan.hpp"

namespace hairnet {

// A monotonic clock, which is called on any thread.
using ClockNs = std::int64_t (*)();

// The cost of stepping characters.
struct StepCost {
  // The sum over all workers, ns.
  std::int64_t step_ns = 0;
  // How many turns were stepped: each counts one, whatever its stride.
  std::uint32_t character_steps = 0;
};

// The costs are summed for each level and each number of ticks that a step covers.
struct StepCosts {
  std::array<std::array<StepCost, kStrideMax>, kLevelCount> sums{};

  // Asserts that `ticks` is from 1 to kStrideMax.
  [[nodiscard]] StepCost& of(LevelIndex level, int ticks) {
    check(level, ticks);
    return sums[static_cast<std::size_t>(level)][static_cast<std::size_t>(ticks - 1)];
  }
  [[nodiscard]] const StepCost& of(LevelIndex level, int ticks) const {
    check(level, ticks);
    return sums[static_cast<std::size_t>(level)][static_cast<std::size_t>(ticks - 1)];
  }

  static void check(LevelIndex level, int ticks) {
    HAIRNET_ASSERT(static_cast<std::size_t>(level) < kLevelCount);
    HAIRNET_ASSERT(ticks >= 1);
    HAIRNET_ASSERT(ticks <= kStrideMax);
  }
};

}  // namespace hairnet
