#include "tests/bench/instructions.hpp"

#include <cstdio>

#include "core/solver/crowd_step.hpp"
#include "tests/bench/step_runner.hpp"

namespace hairnet::bench {
namespace {

// A frame of this rate is one step of the longest shipped length (kStepMax_s).
constexpr double kRate_hz = 50;

}  // namespace

// Outside the unnamed namespace and never inlined, so that it has a name to toggle at.
[[gnu::noinline]] bool perform_steps(StepRunner& performer) {
  return performer.perform();
}

int count_instructions(const Subject& subject, const Options& o) {
  const LevelIndex index = o.callgrind == "high" ? LevelIndex::high : LevelIndex::low;
  const auto i = static_cast<std::size_t>(index);
  const auto level = build_level(subject.groom, kLevelSpecs[i]);
  const StepRunnerSettings settings{.iterations = iterations_for(index, 1 / kRate_hz)};
  const auto steps = static_cast<std::size_t>(o.callgrind_steps);
  const Workload cast =
      make_workload(*level, subject.motions.front(), {kRate_hz, crowd_width(), steps}, settings.iterations);
  const auto performer = o.kernel == "crowd" ? make_crowd(*level, cast, settings) : make_single(*level, cast, settings);
  performer->rewind();
  const bool is_finite = perform_steps(*performer);
  std::printf("%s, %s: %zu characters x %zu steps x %d iterations = divide the instructions by %zu; %s\n",
              o.callgrind.c_str(), o.kernel.c_str(), cast.characters.size(), steps, settings.iterations,
              cast.characters.size() * steps, performer->hash().c_str());
  return is_finite ? 0 : 1;
}

}  // namespace hairnet::bench
