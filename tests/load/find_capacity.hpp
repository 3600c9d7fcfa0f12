#pragma once

#include <functional>
#include <vector>

#include "core/result.hpp"
#include "tests/load/capacity_search.hpp"
#include "tests/load/options.hpp"
#include "tests/load/report.hpp"

namespace hairnet::load {

// Makes the plan of one probe: as the last stage of `plan`, with so many characters; a ramp, then the measured part. A
// stage of one client gets more characters for it; any other stage gets more clients.
Plan probe_plan(const Plan& plan, const CapacitySearch::Probe& probe, const CapacityOptions& options);

// Runs a plan; refused when it cannot.
using Prober = std::function<Result<RunResult>(const Plan&)>;

// Runs the search; `runs` of the report gets the last run that passed, which confirms the capacity, or the first run
// where none passed. A probe with a late generator counts as failed.
Result<void> find_capacity(const Options& options, const Prober& run, Report& report);

}  // namespace hairnet::load
