#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tests/load/plan.hpp"
#include "tests/load/requirement.hpp"
#include "tests/load/stream_client_connection.hpp"

namespace hairnet::load {

// How --find-capacity searches (CapacitySearch::Limits), and the seconds of a probe: its warm-up, the measured part,
// and the measured part of the run that confirms the capacity.
struct CapacityOptions {
  std::uint32_t first = 16, most = 20'000;
  double resolution = 0.05;
  double warm_s = 4, probe_s = 8, confirm_s = 20;
};

struct Options {
  Plan plan;
  Address server;
  Transport transport = Transport::tcp;
  // The server's program, which this one starts. It is empty when the server runs already.
  std::string spawn;
  // The arguments of that program.
  std::vector<std::string> server_arguments;
  std::string server_log = "hairnet-load-server.log";
  std::optional<int> server_pid;
  std::vector<Requirement> requirements;
  double lag_p99_max_ms = 5;
  double check_share = 0, decode_share = 1;
  bool evaluate_learnt = true;
  std::string token;
  bool scrape_metrics = true, quiet = false;
  std::optional<CapacityOptions> capacity;
  // The files for the report; no file is written for an empty name.
  std::string json, html;
  // The command line as it was given.
  std::string command;
};

// The options, or the exit code when there is nothing more to do.
std::variant<Options, int> parse_options(int argc, const char* const* argv);

}  // namespace hairnet::load
