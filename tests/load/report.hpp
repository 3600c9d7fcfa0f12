#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/load/capacity_search.hpp"
#include "tests/load/run.hpp"

namespace hairnet::load {

// The result of a search for the capacity.
struct CapacityPoint {
  CapacitySearch::Probe probe;
  // The figures of the probe's measured stage.
  Figures figures;
};
struct CapacityReport {
  std::uint32_t capacity = 0;
  // The capacity is the largest number that the search may try (CapacityOptions::most).
  bool reached_max = false;
  // Some probe above the capacity met all thresholds but the generator was late, so the server may carry more.
  bool limited_by_generator = false;
  std::vector<CapacityPoint> points;
};

// The numbers are exit codes. 2 is that of a wrong command line.
enum class Outcome : std::uint8_t { ok = 0, threshold = 1, untrusted = 3, failed = 4 };

struct Report {
  // The command line as it was given, and the processor with its number of cores.
  std::string command;
  std::string machine;
  // One run: of a search for the capacity, the last one that passed, or else the first.
  std::vector<RunResult> runs;
  std::optional<CapacityReport> capacity;
  std::vector<Verdict> verdicts;
  double lag_p99_max_ms = 0;
  Outcome outcome = Outcome::ok;
  // One line.
  std::string outcome_text;
};

std::string machine_name();

// The verdicts on one run: its thresholds, and whether it is trusted.
std::vector<Verdict> judge_run(const std::vector<Requirement>& requirements, const RunResult& run);

// Puts the result in one sentence: whether the server held, under how many characters at what rate, and the measured
// figure nearest its threshold, or furthest beyond it.
std::string to_sentence(const Report& report);
std::string to_json_text(const Report& report);
// One HTML page that needs nothing beside itself.
std::string to_page(const Report& report);
// Lines for a terminal.
std::string to_summary(const Report& report);

}  // namespace hairnet::load
