#include "tests/load/report.hpp"

#include <fmt/format.h>

#include <fstream>
#include <limits>
#include <string_view>
#include <thread>

namespace hairnet::load {
namespace {

// A line for each stage with an attack: whether it passed, and what failed.
std::string attack_verdicts(const Report& report) {
  std::string text;
  for (const StageResult& stage : report.runs.back().stages) {
    if (!stage.stage.attack) continue;
    std::string failures;
    for (const Verdict& verdict : report.verdicts)
      if (verdict.stage == stage.stage.name && !verdict.met)
        failures += fmt::format("; {}: {}", verdict.requirement,
                                verdict.value ? fmt::format("{:.4g}", *verdict.value) : "no such figure");
    text += failures.empty() ? fmt::format("attack {}: passed\n", stage.stage.name)
                             : fmt::format("attack {}: FAILED{}\n", stage.stage.name, failures);
  }
  return text;
}

std::string shown(const Figures& figures, const char* name, const char* format) {
  const auto found = figures.find(name);
  return found == figures.end() ? "-" : fmt::format(fmt::runtime(format), found->second);
}

// How much of its threshold a figure uses: above 1 it is not met.
double used_share(const Requirement& requirement, double value) {
  using Relation = Requirement::Relation;
  const bool at_least = requirement.relation == Relation::greater || requirement.relation == Relation::greater_equal;
  const double part = at_least ? requirement.bound : value, whole = at_least ? value : requirement.bound;
  if (whole > 0) return part / whole;
  return part > 0 ? std::numeric_limits<double>::infinity() : 0;
}

// Empty without a threshold.
std::string worst_figure(const Report& report) {
  const Verdict* worst = nullptr;
  double most = -1;
  for (const Verdict& verdict : report.verdicts) {
    const auto requirement = parse_requirement(verdict.requirement);
    if (!requirement) continue;
    const double used =
        verdict.value ? used_share(*requirement, *verdict.value) : std::numeric_limits<double>::infinity();
    if (used <= most) continue;
    most = used;
    worst = &verdict;
  }
  if (!worst) return {};
  const std::string where = worst->stage.empty() ? "" : fmt::format(" in stage {}", worst->stage);
  if (!worst->value) return fmt::format("; {} could not be judged{}", worst->requirement, where);
  return fmt::format("; nearest to its threshold is {:.4g}{}, of {}", *worst->value, where, worst->requirement);
}

// Finds the measured stage with the most characters.
const StageResult* largest_stage(const Report& report) {
  const StageResult* largest = nullptr;
  const auto characters = [](const StageResult& stage) {
    const auto found = stage.figures.find("characters");
    return found == stage.figures.end() ? 0.0 : found->second;
  };
  if (report.runs.empty()) return nullptr;
  for (const StageResult& stage : report.runs.back().stages)
    if (stage.stage.measured && (!largest || characters(stage) > characters(*largest))) largest = &stage;
  return largest;
}

}  // namespace

std::string to_sentence(const Report& report) {
  const StageResult* stage = largest_stage(report);
  if (!stage || report.outcome == Outcome::failed || report.outcome == Outcome::untrusted)
    return "This run says nothing about the server: " +
           (report.outcome_text.empty() ? "nothing was measured" : report.outcome_text) + ".";
  const Figures& figures = stage->figures;
  const std::string load =
      fmt::format("{} characters of {} clients, {} frames a second for each", shown(figures, "characters", "{:.0f}"),
                  shown(figures, "clients", "{:.0f}"), shown(figures, "frames_per_character_s", "{:.1f}"));
  const char* held = report.outcome == Outcome::threshold ? "The server did not hold"
                     : report.verdicts.empty()            ? "No threshold was given; the server carried"
                                                          : "The server held";
  const std::string capacity =
      report.capacity ? fmt::format("Capacity: {} characters. ", report.capacity->capacity) : "";
  return fmt::format("{}{} {}{}.", capacity, held, load, worst_figure(report));
}

std::string machine_name() {
  std::ifstream file("/proc/cpuinfo");
  std::string model = "unknown processor";
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("model name")) continue;
    if (const std::size_t colon = line.find(": "); colon != std::string::npos) model = line.substr(colon + 2);
    break;
  }
  return fmt::format("{}, {} cores", model, std::thread::hardware_concurrency());
}

std::vector<Verdict> judge_run(const std::vector<Requirement>& requirements, const RunResult& run) {
  std::vector<NamedFigures> stages;
  for (const StageResult& stage : run.stages)
    stages.push_back({stage.stage.name, stage.stage.measured, &stage.figures});
  return judge(requirements, stages);
}

std::string to_summary(const Report& report) {
  std::string text;
  if (!report.runs.empty()) {
    text +=
        fmt::format("{:<12}{:>9}{:>7}{:>8}{:>8}{:>8}{:>9}{:>8}{:>9}{:>9}{:>8}{:>8}{:>8}\n", "stage", "chars", "p50 ms",
                    "p90", "p99", "p99.9", "max", "jitter", "missed %", "kB/s/ch", "errors", "server", "lag ms");
    for (const StageResult& stage : report.runs.back().stages) {
      const Figures& f = stage.figures;
      const auto percent = f.find("frames_missed_share"), bytes = f.find("bytes_in_per_character_s");
      text +=
          fmt::format("{:<12}{:>9}{:>7}{:>8}{:>8}{:>8}{:>9}{:>8}{:>9}{:>9}{:>8}{:>8}{:>8}\n",
                      stage.stage.name + (stage.stage.measured ? "" : " *"), shown(f, "characters", "{:.0f}"),
                      shown(f, "latency_p50_ms", "{:.1f}"), shown(f, "latency_p90_ms", "{:.1f}"),
                      shown(f, "latency_p99_ms", "{:.1f}"), shown(f, "latency_p999_ms", "{:.1f}"),
                      shown(f, "latency_max_ms", "{:.1f}"), shown(f, "jitter_p99_ms", "{:.1f}"),
                      percent == f.end() ? "-" : fmt::format("{:.2f}", percent->second * 100),
                      bytes == f.end() ? "-" : fmt::format("{:.2f}", bytes->second / 1e3), shown(f, "errors", "{:.0f}"),
                      shown(f, "server_cpu_cores", "{:.2f}"), shown(f, "generator_lag_p99_ms", "{:.1f}"));
    }
    text += "(* not measured; server: cores used; lag: of the generator, p99)\n";
    for (const StageResult& stage : report.runs.back().stages) {
      for (const auto& [reason, count] : stage.tally.counts.errors)
        text += fmt::format("{}: {} x {}\n", stage.stage.name, count, reason);
      for (const auto& [end, count] : stage.tally.counts.bad_client_ends)
        text += fmt::format("{}: misbehaving {} ({} times)\n", stage.stage.name, end, count);
    }
    for (const auto& [failure, count] : report.runs.back().check_failures)
      text += fmt::format("check: {} x {}\n", count, failure);
  }
  if (report.capacity) {
    for (const CapacityPoint& point : report.capacity->points)
      text += fmt::format("{:>8} characters: {}{}, p99 {} ms\n", point.probe.characters,
                          point.probe.passed ? "passed" : "failed", point.probe.confirms ? " (confirming)" : "",
                          shown(point.figures, "latency_p99_ms", "{:.1f}"));
  }
  if (!report.runs.empty()) text += attack_verdicts(report);
  const bool attacked = !report.runs.empty() && report.runs.back().plan.has_attacks();
  for (const Verdict& verdict : report.verdicts)
    if (!attacked || !verdict.met)
      text += fmt::format("{} {} [{}]: {}\n", verdict.met ? "met   " : "FAILED", verdict.requirement, verdict.stage,
                          verdict.value ? fmt::format("{:.4g}", *verdict.value) : "no such figure");
  return text + report.outcome_text + "\n";
}

}  // namespace hairnet::load
