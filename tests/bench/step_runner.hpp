#pragma once

#include <memory>
#include <string>

#include "core/levels/level.hpp"
#include "tests/bench/workload.hpp"

namespace hairnet::bench {

// One implementation of the step that can be timed: it steps the characters of a workload, always from the same states.
class StepRunner {
 public:
  virtual ~StepRunner() = default;
  // Goes back to the cast's states.
  virtual void rewind() = 0;
  // Steps all frames of all characters. False when a lattice is not finite.
  [[nodiscard]] virtual bool perform() = 0;
  [[nodiscard]] virtual std::vector<LatticeState> states() const = 0;
  // Covers all states as they are.
  [[nodiscard]] virtual std::string hash() const = 0;
};

struct StepRunnerSettings {
  int iterations = 16;
  int steps_per_frame = 1;
  // May end a baseline's iterations earlier.
  double relative_residual = 0;
};

enum class Baseline : bool { naive, fair };

// `level` and `cast` must outlive them.
std::unique_ptr<StepRunner> make_baseline(Baseline kind, const Level& level, const Workload& cast,
                                          const StepRunnerSettings& settings);
std::unique_ptr<StepRunner> make_single(const Level& level, const Workload& cast, const StepRunnerSettings& settings);
std::unique_ptr<StepRunner> make_crowd(const Level& level, const Workload& cast, const StepRunnerSettings& settings);

}  // namespace hairnet::bench
