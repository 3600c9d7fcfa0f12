#include "tests/bench/correctness.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>

#include "core/solver/reference_step.hpp"

namespace hairnet::bench {
namespace {

constexpr std::size_t kPlayers = 3;
// With so many iterations every solver converges. The baselines have no preconditioner and need more. They and the
// reference stop at the relative residual kResidual.
constexpr int kConverged = 1000, kBaselineConverged = 20'000;
constexpr double kResidual = 1e-10;
// These are the largest distances from the reference: of the baselines, which work in double, and of our solver, which
// works in float.
constexpr double kBaselineOff_m = 1e-6, kOff_m = 2e-5;

// Returns a few characters with one frame each. The reference has no limit of energy, so these steps have none from an
// earlier one.
Workload some_of(const Workload& cast) {
  Workload some{cast.frame_s, 1, {}};
  for (std::size_t c = 0; c < std::min(kPlayers, cast.characters.size()); ++c) {
    // The characters are spread evenly over all of them.
    BenchCharacter character = cast.characters[c * cast.characters.size() / kPlayers];
    character.poses.resize(2);
    character.state.elastic_energy_max_j = std::numeric_limits<float>::infinity();
    some.characters.push_back(std::move(character));
  }
  return some;
}

double max_off_m(StepRunner& performer, const std::vector<LatticeState>& truth) {
  performer.rewind();
  if (!performer.perform()) return std::numeric_limits<double>::infinity();
  const std::vector<LatticeState> states = performer.states();
  double most = 0;
  for (std::size_t c = 0; c < truth.size(); ++c) {
    for (std::size_t i = 0; i < truth[c].displacement.size(); ++i) {
      most = std::max(most, static_cast<double>((states[c].displacement[i] - truth[c].displacement[i]).norm()));
    }
  }
  return most;
}

}  // namespace

double check_against_reference(const Level& level, const Workload& cast, const std::string& where, Report& report) {
  const Workload some = some_of(cast);
  std::vector<LatticeState> truth;
  for (const BenchCharacter& character : some.characters) {
    const StepInput input = step_input(some, character, 0, 0, 1);
    WorldLattice lattice = to_world(level, input.from.head(), character.state);
    reference_step(level, input, lattice, kResidual);
    truth.push_back(to_head(level, input.to.head(), lattice));
  }
  const auto check = [&](const char* name, std::unique_ptr<StepRunner> performer, double bound_m) {
    const double off_m = max_off_m(*performer, truth);
    if (off_m <= bound_m) return off_m;
    char text[160];
    std::snprintf(text, sizeof text, ": %s is %.3g m off the reference, which is more than %.3g m", name, off_m,
                  bound_m);
    report.fail(where + text);
    return off_m;
  };
  const StepRunnerSettings baseline{kBaselineConverged, 1, kResidual}, ours{kConverged, 1, 0};
  check("naive", make_baseline(Baseline::naive, level, some, baseline), kBaselineOff_m);
  check("fair", make_baseline(Baseline::fair, level, some, baseline), kBaselineOff_m);
  return std::max(check("single", make_single(level, some, ours), kOff_m),
                  check("crowd", make_crowd(level, some, ours), kOff_m));
}

}  // namespace hairnet::bench
