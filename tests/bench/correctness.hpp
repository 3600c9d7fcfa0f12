#pragma once

#include <string>

#include "tests/bench/performer.hpp"
#include "tests/bench/report.hpp"

namespace hairnet::bench {

// Steps solved to convergence from the same states must be those of reference_step, for the baselines and for our
// kernels alike; what is not goes into the report, as the failure of `where`. Returns the most that any node of ours is
// off, m.
double check_against_reference(const Level& level, const Cast& cast, const std::string& where, Report& report);

}  // namespace hairnet::bench
