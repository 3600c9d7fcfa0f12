#include "server/tick/budget_cost.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// A first estimate of the seconds of a turn over 1, 2 and 4 ticks of 1/30 s in full batches (hairnet-fidelity stride).
constexpr double kTableTick_s = 1.0 / 30;
constexpr std::array<std::array<double, 3>, kLevelCount> kTable_s{{{86.3e-6, 86.6e-6, 117.8e-6},
                                                                   {28.3e-6, 30.1e-6, 38.8e-6},
                                                                   {11.2e-6, 12.6e-6, 17.0e-6},
                                                                   {2.7e-6, 2.7e-6, 2.8e-6},
                                                                   {0.7e-6, 1.3e-6, 2.5e-6},
                                                                   {0, 0, 0}}};

// Bounds samples against the table's time, both ways: a slow machine is allowed, but no hiccup.
constexpr double kFirstSampleMax = 30;
// A single tick counts at most this many times the estimate, or one over it.
constexpr double kSampleMax = 2;
// Weighs a tick with enough character-steps to be significant.
constexpr double kGain = 0.1;
constexpr double kFullSteps = 16;
// All levels together tell how fast the machine is, so this mean may move slower than each level's own.
constexpr double kMachineGain = 0.05;

std::size_t index_of(int stride) {
  HAIRNET_ASSERT(stride == 1 || stride == 2 || stride == 4);
  return static_cast<std::size_t>(std::countr_zero(static_cast<unsigned>(stride)));
}

}  // namespace

CostEstimate::CostEstimate(double tick_s) {
  HAIRNET_ASSERT(tick_s > 0);
  for (std::size_t l = 0; l < kLevelCount; ++l) {
    for (std::size_t s = 0; s < kStrides; ++s) estimates_[l][s].table_s = kTable_s[l][s] * (tick_s / kTableTick_s);
  }
}

void CostEstimate::observe(const StepCosts& costs) {
  for (std::size_t l = 0; l < kLevelCount; ++l) {
    for (const int stride : {1, 2, 4}) {
      const StepCost& cost = costs.of(static_cast<LevelIndex>(l), stride);
      Estimate& estimate = estimates_[l][index_of(stride)];
      if (cost.character_steps == 0 || cost.step_ns <= 0 || estimate.table_s <= 0) continue;
      const double sample_s = 1e-9 * static_cast<double>(cost.step_ns) / cost.character_steps;
      const double ratio = std::clamp(sample_s / estimate.table_s, 1 / kFirstSampleMax, kFirstSampleMax);
      // The first sample replaces the table's value at once; a slow mean would start from a machine that is not this
      // one.
      if (!estimate.is_measured) {
        estimate.is_measured = true;
        estimate.measured_s = ratio * estimate.table_s;
      }
      // By factors, so that one late tick in ten does not pull up the mean of the other nine.
      const double off = std::clamp(sample_s / estimate.measured_s, 1 / kSampleMax, kSampleMax);
      const double share = std::min(1.0, cost.character_steps / kFullSteps);
      estimate.measured_s *= std::pow(off, kGain * share);
      machine_ *= std::pow(std::clamp(ratio / machine_, 1 / kSampleMax, kSampleMax), kMachineGain * share);
      HAIRNET_ASSERT(estimate.measured_s > 0 && std::isfinite(estimate.measured_s));
      HAIRNET_ASSERT(machine_ > 0 && std::isfinite(machine_));
    }
  }
}

double CostEstimate::turn_s(LevelIndex level, int stride) const {
  const Estimate& estimate = estimates_[static_cast<std::size_t>(level)][index_of(stride)];
  return estimate.is_measured ? estimate.measured_s : machine_ * estimate.table_s;
}

}  // namespace hairnet::server
