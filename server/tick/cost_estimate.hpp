#pragma once

#include <array>

#include "core/world/step_cost.hpp"

namespace hairnet::server {

// The time to step one character, by level and stride, which the budget (budget.hpp) spends. It is a mean of measured
// times. Where nothing has been measured yet, it is the time of a table, made once on another machine (kTable_s), times
// this machine's measured ratio to that table.
class CostEstimate {
 public:
  explicit CostEstimate(double tick_s);

  // Takes the measured costs of the steps of one tick into the means.
  void observe(const StepCosts& costs);

  // Returns the worker-seconds of one turn, which is one step over `stride` (1, 2 or 4) ticks. 0 on the rigid level.
  [[nodiscard]] double turn_s(LevelIndex level, int stride) const;

 private:
  // Strides 1, 2 and 4.
  static constexpr std::size_t kStrides = 3;
  // The table's time for this tick length, and the mean of the measured times, both for one turn.
  struct Estimate {
    double table_s = 0, measured_s = 0;
    bool is_measured = false;
  };

  std::array<std::array<Estimate, kStrides>, kLevelCount> estimates_{};
  // The measured time over the table's time, for all levels together.
  double machine_ = 1;
};

}  // namespace hairnet::server
