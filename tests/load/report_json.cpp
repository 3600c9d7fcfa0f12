#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/load/report.hpp"

namespace hairnet::load {
namespace {

using Json = nlohmann::ordered_json;

double rounded(double value) {
  // Six digits: measurements are no more precise, and files stay small.
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return std::strtod(text, nullptr);
}

Json figures_json(const Figures& figures) {
  Json json = Json::object();
  for (const auto& [name, value] : figures) json[name] = rounded(value);
  return json;
}

Json tail_json(const LatencyHistogram& times) {
  Json json = Json::array();
  for (const auto& [time_ms, above] : times.tail()) json.push_back({rounded(time_ms), rounded(above)});
  return json;
}

Json stage_json(const StageResult& stage) {
  return {{"name", stage.stage.name},
          {"kind", kStageKindNames[static_cast<std::size_t>(stage.stage.kind)]},
          {"measured", stage.stage.measured},
          {"begin_s", rounded(stage.begin_s)},
          {"duration_s", rounded(stage.duration_s)},
          {"figures", figures_json(stage.figures)},
          {"errors", stage.tally.counts.errors},
          {"bad_client_ends", stage.tally.counts.bad_client_ends},
          {"generator_thread_cpu_s", figures_json(stage.own.thread_cpu_s)},
          {"server_thread_cpu_s", figures_json(stage.server.thread_cpu_s)},
          {"latency_tail", tail_json(stage.tally.latency)},
          {"server_metrics", figures_json(stage.server_metrics)}};
}

Json windows_json(const std::vector<WindowFigures>& windows) {
  Json json = Json::array();
  for (const WindowFigures& w : windows) {
    json.push_back({{"begin_s", rounded(w.begin_s)},
                    {"duration_s", rounded(w.duration_s)},
                    {"latency_p50_ms", rounded(w.latency_p50_ms)},
                    {"latency_p99_ms", rounded(w.latency_p99_ms)},
                    {"latency_max_ms", rounded(w.latency_max_ms)},
                    {"generator_lag_max_ms", rounded(w.lag_max_ms)},
                    {"clients", rounded(w.clients)},
                    {"characters", rounded(w.characters)},
                    {"frames", w.frames},
                    {"frames_missed", w.frames_missed},
                    {"frames_by_level", w.frames_by_level},
                    {"bytes_in", w.bytes_in},
                    {"bytes_out", w.bytes_out},
                    {"content_bytes", w.content_bytes},
                    {"errors", w.errors},
                    {"poses_unanswered", w.poses_unanswered},
                    {"poses_unsent", w.poses_unsent}});
  }
  return json;
}

Json run_json(const RunResult& run) {
  Json stages = Json::array(), processes = Json::array();
  for (const StageResult& stage : run.stages) stages.push_back(stage_json(stage));
  for (const ProcessPoint& p : run.processes)
    processes.push_back({{"at_s", rounded(p.at_s)},
                         {"generator_cpu_cores", rounded(p.generator_cpu_cores)},
                         {"generator_resident_mib", rounded(p.generator_resident_mib)},
                         {"server_cpu_cores", rounded(p.server_cpu_cores)},
                         {"server_resident_mib", rounded(p.server_resident_mib)}});
  return {{"tick_rate_hz", run.tick_rate_hz},     {"ended_early", run.ended_early},
          {"server_died", run.server_died},       {"generator_lag_p99_ms", rounded(run.generator_lag_p99_ms)},
          {"check_failures", run.check_failures}, {"stages", std::move(stages)},
          {"windows", windows_json(run.windows)}, {"processes", std::move(processes)}};
}

Json capacity_json(const CapacityReport& capacity) {
  Json points = Json::array();
  for (const CapacityPoint& point : capacity.points)
    points.push_back({{"characters", point.probe.characters},
                      {"passed", point.probe.passed},
                      {"confirms", point.probe.confirms},
                      {"figures", figures_json(point.figures)}});
  return {{"characters", capacity.capacity},
          {"reached_max", capacity.reached_max},
          {"limited_by_generator", capacity.limited_by_generator},
          {"probes", std::move(points)}};
}

Json verdicts_json(const std::vector<Verdict>& verdicts) {
  Json json = Json::array();
  for (const Verdict& verdict : verdicts)
    json.push_back({{"requirement", verdict.requirement},
                    {"stage", verdict.stage},
                    {"value", verdict.value ? Json(rounded(*verdict.value)) : Json()},
                    {"met", verdict.met}});
  return json;
}

}  // namespace

std::string to_json_text(const Report& report) {
  Json json{{"program", "hairnet-load"},
            {"command", report.command},
            {"machine", report.machine},
            {"outcome", report.outcome_text},
            {"exit_code", static_cast<int>(report.outcome)},
            {"generator_lag_p99_max_ms", report.lag_p99_max_ms},
            {"verdicts", verdicts_json(report.verdicts)}};
  if (report.capacity) json["capacity"] = capacity_json(*report.capacity);
  if (!report.runs.empty()) {
    json["plan"] = Json::parse(to_json_text(report.runs.back().plan));
    json["run"] = run_json(report.runs.back());
  }
  return json.dump(1) + "\n";
}

}  // namespace hairnet::load
