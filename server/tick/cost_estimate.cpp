#include "server/tick/cost_estimate.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// The table: a first estimate of the seconds of one turn in full batches, printed by `hairnet-fidelity stride`. A row
// is a level, in the order of LevelIndex: high, medium, low, ether, learnt, rigid. A column is a turn over 1, 2 or 4
// ticks of 1/30 s. For another length of the tick the values are scaled in proportion.
constexpr double kTableTick_s = 1.0 / 30;
constexpr std::array<std::array<double, 3>, kLevelCount> kTable_s{{{86.3e-6, 86.6e-6, 117.8e-6},
                                                                   {28.3e-6, 30.1e-6, 38.8e-6},
                                                                   {11.2e-6, 12.6e-6, 17.0e-6},
                                                                   {2.7e-6, 2.7e-6, 2.8e-6},
                                                                   {0.7e-6, 1.3e-6, 2.5e-6},
                                                                   {0, 0, 0}}};

// A first sample counts as at most 30 times the table's time, and at least a thirtieth of it. A slow machine lies
// within these bounds; an interruption of the process may not.
constexpr double kFirstSampleMax = 30;
// A later sample counts as at most twice the estimate, and at least half of it.
constexpr double kSampleMax = 2;
// The weight of one tick in the mean of a level and stride, if the tick has kFullSteps steps of characters or more;
// fewer steps weigh proportionally less, because their mean time is less certain.
constexpr double kGain = 0.1;
constexpr double kFullSteps = 16;
// The weight of one such tick in machine_. Samples of all levels move it, so its weight is smaller than kGain.
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
      // The mean is one of factors, that is of logarithms, and each factor is bounded by kSampleMax: one late tick in
      // ten does not pull up the mean of the other nine.
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
