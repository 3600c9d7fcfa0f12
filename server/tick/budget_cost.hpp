#pragma once

#include <array>

#include "core/world/step_cost.hpp"

namespace hairnet::server {

// What stepping one character takes, by level and stride, as measured while it runs. What has not been measured yet is
// the table's figure times what has been measured over the table's.
class CostEstimate {
 public:
  explicit CostEstimate(double tick_s);

  void take(const StepCosts& costs);  // of one tick

  // Worker-seconds of one turn, which is over `stride` (1, 2 or 4) ticks. None on the rigid level.
  [[nodiscard]] double turn_s(LevelIndex level, int stride) const;

 private:
  static constexpr std::size_t kStrides = 3;
  struct Estimate {
    double table_s = 0, measured_s = 0;
    bool is_measured = false;
  };

  std::array<std::array<Estimate, kStrides>, kLevelCount> estimates_{};
  double machine_ = 1;  // measured over the table's, of all levels together
};

}  // namespace hairnet::server
