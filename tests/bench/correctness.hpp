#pragma once

#include <string>

#include "tests/bench/report.hpp"
#include "tests/bench/step_runner.hpp"

namespace hairnet::bench {

// Checks that converged steps from the same states equal those of reference_step, for the baselines and for our
// kernels. Differences go into the report under `where`. Returns the largest error of a node of our kernels, m.
double check_against_reference(const Level& level, const Workload& cast, const std::string& where, Report& report);

}  // namespace hairnet::bench
