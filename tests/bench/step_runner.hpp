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
  // Goes back to the states of the workload's characters.
  virtual void rewind() = 0;
  // Steps all frames of all characters. False when a lattice is not finite.
  [[nodiscard]] virtual bool perform() = 0;
  [[nodiscard]] virtual std::vector<LatticeState> states() const = 0;
  // Returns a hash of the present states of all characters.
  [[nodiscard]] virtual std::string hash() const = 0;
};

struct StepRunnerSettings {
  int iterations = 16;
  int steps_per_frame = 1;
  // A baseline's iterations end earlier once the residual is below this share of the load; 0 means never.
  double relative_residual = 0;
};

// The paper's method in two forms (README.md): `naive` builds its matrix from triplets in each step, `fair` writes into
// a fixed pattern.
enum class Baseline : bool { naive, fair };

// Make a baseline, our kernel of one character, and our kernel of many. `level` and `cast` must outlive the result.
std::unique_ptr<StepRunner> make_baseline(Baseline kind, const Level& level, const Workload& cast,
                                          const StepRunnerSettings& settings);
std::unique_ptr<StepRunner> make_single(const Level& level, const Workload& cast, const StepRunnerSettings& settings);
std::unique_ptr<StepRunner> make_crowd(const Level& level, const Workload& cast, const StepRunnerSettings& settings);

}  // namespace hairnet::bench
