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
  // Belong to its measured stage.
  Figures figures;
};
struct CapacityReport {
  std::uint32_t capacity = 0;
  // Says that more was not tried.
  bool reached_max = false;
  // Above the capacity the generator was late: the server may carry more.
  bool limited_by_generator = false;
  std::vector<CapacityPoint> points;
};

enum class Outcome : std::uint8_t { ok = 0, threshold = 1, untrusted = 3, failed = 4 };  // the exit code; 2: usage

struct Report {
  std::string command;          // as given
  std::string machine;          // processor and number of cores
  std::vector<RunResult> runs;  // one; of a search the confirming one, or the last
  std::optional<CapacityReport> capacity;
  std::vector<Verdict> verdicts;
  double lag_p99_max_ms = 0;
  Outcome outcome = Outcome::ok;
  std::string outcome_text;  // one line
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
