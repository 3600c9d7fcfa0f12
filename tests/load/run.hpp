#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "tests/load/assets.hpp"
#include "tests/load/exposition.hpp"
#include "tests/load/plan.hpp"
#include "tests/load/process_sampler.hpp"
#include "tests/load/requirement.hpp"
#include "tests/load/stream_client_connection.hpp"
#include "tests/load/tally.hpp"

namespace hairnet::load {

struct RunOptions {
  Address server;
  // All clients use it; attackers use TCP.
  Transport transport = Transport::tcp;
  // The server's process, if its processor time and memory are to be measured.
  std::optional<pid_t> server_pid;
  // The share of characters whose frames FrameCheck checks.
  double check_share = 0;
  // The share of members whose frames clients decode.
  double decode_share = 1;
  // Clients evaluate learnt hair themselves.
  bool evaluate_learnt = true;
  std::string token;
  bool scrape_metrics = true;
  // The run ends early once this flag is true. It may be null, and must outlive the run.
  const std::atomic<bool>* stop = nullptr;
};

// The state of a run for display, twice a second.
struct RunProgress {
  double time_s = 0, duration_s = 0;
  std::string stage;
  std::size_t clients = 0, characters = 0, bad_clients = 0;
  WindowFigures latest;
  double generator_cpu_cores = 0, server_cpu_cores = 0, server_resident_mib = 0;
  std::uint64_t check_failures = 0;
};

struct StageResult {
  Stage stage;
  // The begin and the length of the measured part, without the warm-up.
  double begin_s = 0, duration_s = 0;
  Figures figures;
  StageTally tally;
  ProcessUse own, server;
  // The growth of the server's metrics during the stage (exposition_between); it is empty when there were no samples.
  Exposition server_metrics;
};

struct ProcessPoint {
  double at_s = 0, generator_cpu_cores = 0, generator_resident_mib = 0, server_cpu_cores = 0, server_resident_mib = 0;
  // The memory of the server's child processes, which build levels. It is sampled only in a plan with attacks.
  double builds_resident_mib = 0;
};

struct RunResult {
  Plan plan;
  std::uint32_t tick_rate_hz = 0;
  bool ended_early = false, server_died = false;
  std::vector<StageResult> stages;
  std::vector<WindowFigures> windows;
  std::vector<ProcessPoint> processes;
  std::map<std::string, std::uint64_t> check_failures;
  // The lag of all measured stages together.
  double generator_lag_p99_ms = 0;
};

// Carries a plan out against a server, in real time, on the calling thread. `show` is called twice a second, and may be
// empty. The error is one line: there is no server at the begin, or it accepts no groom.
Result<RunResult> run_plan(const Plan& plan, const Assets& assets, const RunOptions& options,
                           const std::function<void(const RunProgress&)>& show);

}  // namespace hairnet::load
