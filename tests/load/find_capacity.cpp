#include "tests/load/find_capacity.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::load {

namespace {

// With one client the search changes its number of characters. With several it changes the number of clients, and each
// keeps its characters.
bool is_one_client(const Plan& plan) {
  return plan.stages.back().clients == 1;
}

}  // namespace

Plan probe_plan(const Plan& plan, const CapacitySearch::Probe& probe, const CapacityOptions& options) {
  Stage ramp = plan.stages.back();
  ramp.characters = is_one_client(plan) ? probe.characters : std::min(ramp.characters, probe.characters);
  ramp.clients = probe.characters / ramp.characters;
  ramp.kind = StageKind::ramp;
  ramp.name = "ramp";
  // Clients join during three quarters of the time before the measured part, and settle in the last quarter.
  ramp.duration_s = options.warm_s * 0.75;
  ramp.warm_s = ramp.churn_hz = ramp.storm_share = 0;
  ramp.measured = false;
  Stage steady = plan.stages.back();
  steady.clients = ramp.clients;
  steady.characters = ramp.characters;
  steady.kind = StageKind::steady;
  steady.name = "probe";
  steady.warm_s = options.warm_s * 0.25;
  steady.duration_s = steady.warm_s + (probe.confirms ? options.confirm_s : options.probe_s);
  steady.measured = true;
  Plan probed = plan;
  probed.stages = {std::move(ramp), std::move(steady)};
  return probed;
}

Result<void> find_capacity(const Options& options, const Prober& run, Report& report) {
  CapacitySearch search({.first = options.capacity->first,
                         .most = options.capacity->most,
                         .resolution = options.capacity->resolution,
                         .granule = is_one_client(options.plan) ? 1 : options.plan.stages.back().characters});
  CapacityReport found;
  while (const auto probe = search.next()) {
    auto result = run(probe_plan(options.plan, *probe, *options.capacity));
    if (!result) return Refusal(result.error());
    const bool complete = !result->ended_early && !result->server_died && !result->stages.empty();
    const bool trusted = result->generator_lag_p99_ms <= options.lag_p99_max_ms;
    std::vector<Verdict> verdicts = judge_run(options.requirements, *result);
    const bool met = std::ranges::all_of(verdicts, &Verdict::met);
    // The server has held the thresholds, but the generator was too late to be sure. The search treats this as a
    // failure.
    if (complete && met && !trusted) found.limited_by_generator = true;
    search.report(complete && met && trusted);
    found.points.push_back({search.probes().back(), complete ? result->stages.back().figures : Figures()});
    const bool early = result->ended_early, died = result->server_died;
    // The report shows the last run that passed, and a failed one only until then.
    if (report.runs.empty() || search.probes().back().passed) {
      report.runs.clear();
      report.runs.push_back(std::move(*result));
      report.verdicts = std::move(verdicts);
    }
    if (died) return Refusal("the server died at " + std::to_string(probe->characters) + " characters");
    if (early) return Refusal("stopped");
  }
  found.capacity = search.capacity();
  found.reached_max = search.reached_max();
  report.capacity = std::move(found);
  return {};
}

}  // namespace hairnet::load
