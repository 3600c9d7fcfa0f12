#include <fmt/format.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <memory>
#include <span>

#include "client/files/write_file.hpp"
#include "client/tools/command_line/run_program.hpp"
#include "core/broken_pipe.hpp"
#include "tests/load/find_capacity.hpp"
#include "tests/load/live_view.hpp"
#include "tests/load/options.hpp"
#include "tests/load/report.hpp"
#include "tests/load/spawned_server.hpp"

namespace hairnet::load {
namespace {

// A signal sets this flag, and the run that is under way then ends early.
std::atomic<bool> stop_asked{false};

int fail(const std::string& error) {
  std::fputs(fmt::format("hairnet-load: {}\n", error).c_str(), stderr);
  return static_cast<int>(Outcome::failed);
}

// Each connection needs a descriptor: raises the limit as far as allowed.
void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

// The first of these facts that holds decides: the run is not complete, the generator itself was late, no load passes,
// a threshold is not met.
void judge(const Options& options, Report& report) {
  const RunResult& run = report.runs.back();
  const bool complete = !run.ended_early && !run.server_died;
  const auto failed = std::ranges::count(report.verdicts, false, &Verdict::met);
  const bool trusted = run.generator_lag_p99_ms <= options.lag_p99_max_ms;
  if (!complete) {
    report.outcome = Outcome::failed;
    report.outcome_text = run.server_died ? "the server died" : "ended early: nothing counts";
  } else if (!trusted) {
    report.outcome = Outcome::untrusted;
    report.outcome_text = fmt::format("not to be trusted: the generator itself was late, p99 {:.1f} ms, bound {:g} ms",
                                      run.generator_lag_p99_ms, options.lag_p99_max_ms);
  } else if (report.capacity && report.capacity->capacity == 0) {
    report.outcome = Outcome::threshold;
    report.outcome_text = "no number of characters holds";
  } else if (report.capacity) {
    report.outcome_text = fmt::format("{} characters hold{}", report.capacity->capacity,
                                      report.capacity->reached_max            ? "; more was not tried"
                                      : report.capacity->limited_by_generator ? "; above that the generator is late"
                                                                              : "");
  } else if (failed > 0) {
    report.outcome = Outcome::threshold;
    report.outcome_text = fmt::format("{} of {} thresholds not met", failed, report.verdicts.size());
  } else {
    report.outcome_text = report.verdicts.empty() ? "done; no thresholds were given"
                                                  : fmt::format("all {} thresholds met", report.verdicts.size());
  }
}

Result<void> write(const std::string& path, const std::string& text) {
  if (path.empty()) return {};
  const auto written = write_file(path, std::as_bytes(std::span(text)));
  if (!written) return Refusal(path + ": " + written.error());
  return {};
}

int perform(const Options& options) {
  if (const auto possible =
          // A file that cannot be written is found before the run, not after an hour of it.
      check_can_write({options.json, options.html, options.spawn.empty() ? "" : options.server_log});
      !possible)
    return fail(possible.error());
  auto assets = load_assets(options.plan);
  if (!assets) return fail(assets.error());
  RunOptions run_options;
  run_options.server = options.server;
  run_options.transport = options.transport;
  run_options.server_pid = options.server_pid;
  run_options.check_share = options.check_share;
  run_options.decode_share = options.decode_share;
  run_options.evaluate_learnt = options.evaluate_learnt;
  run_options.token = options.token;
  run_options.scrape_metrics = options.scrape_metrics;
  run_options.stop = &stop_asked;
  std::unique_ptr<SpawnedServer> server;
  if (!options.spawn.empty()) {
    auto started = SpawnedServer::start(options.spawn, options.server_arguments, options.server_log);
    if (!started) return fail(started.error());
    server = std::move(*started);
    run_options.server = {"127.0.0.1", server->port()};
    run_options.server_pid = server->pid();
  }
  LiveView view(stdout, isatty(STDOUT_FILENO) == 1);
  const auto show = [&](const RunProgress& progress) {
    if (!options.quiet) view.show(progress);
  };
  const Prober run = [&](const Plan& plan) {
    auto result = run_plan(plan, *assets, run_options, show);
    view.end();
    return result;
  };

  Report report;
  report.command = options.command;
  report.machine = machine_name();
  report.lag_p99_max_ms = options.lag_p99_max_ms;
  if (options.capacity) {
    if (const auto found = find_capacity(options, run, report); !found) return fail(found.error());
  } else {
    auto result = run(options.plan);
    if (!result) return fail(result.error());
    report.verdicts = judge_run(options.requirements, *result);
    report.runs.push_back(std::move(*result));
  }
  judge(options, report);
  std::fputs(to_summary(report).c_str(), stdout);
  if (const auto written = write(options.json, to_json_text(report)); !written) return fail(written.error());
  if (const auto written = write(options.html, to_page(report)); !written) return fail(written.error());
  return static_cast<int>(report.outcome);
}

}  // namespace
}  // namespace hairnet::load

int main(int argc, char** argv) {
  hairnet::ignore_broken_pipes();
  return hairnet::run_program("hairnet-load", [&] {
    const auto parsed = hairnet::load::parse_options(argc, argv);
    if (const int* exit_code = std::get_if<int>(&parsed)) return *exit_code;
    hairnet::load::raise_descriptor_limit();
    for (const int number : {SIGINT, SIGTERM}) signal(number, [](int) { hairnet::load::stop_asked = true; });
    return hairnet::load::perform(std::get<hairnet::load::Options>(parsed));
  });
}
