#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "tests/load/html_page.hpp"
#include "tests/load/report.hpp"
#include "tests/load/stage_figures.hpp"
#include "tests/load/svg_chart.hpp"

namespace hairnet::load {
namespace {

std::string number(double value) {
  return std::abs(value) >= 1e3 ? fmt::format("{:.0f}", value) : fmt::format("{:.4g}", value);
}

class Page {
 public:
  explicit Page(const Report& report) : report_(report) {}

  std::string write() {
    html_ = html_head("hairnet-load");
    const char* colour = report_.outcome == Outcome::ok ? "good" : "bad";
    html_ += fmt::format("<h1>hairnet-load</h1><p class=\"{}\"><strong>{}</strong></p>\n", colour,
                         escaped(to_sentence(report_)));
    html_ += fmt::format("<p class=\"sub\">{}</p><p class=\"sub\">{}</p><p class=\"{}\">{}</p>\n",
                         escaped(report_.machine), escaped(report_.command), colour, escaped(report_.outcome_text));
    write_verdicts();
    if (report_.capacity) write_capacity(*report_.capacity);
    if (!report_.runs.empty()) write_run(report_.runs.back());
    return html_ + "</body></html>\n";
  }

 private:
  void table(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows) {
    html_ += html_table(head, rows);
  }

  void write_verdicts() {
    if (report_.verdicts.empty()) return;
    std::vector<std::vector<std::string>> rows;
    for (const Verdict& v : report_.verdicts)
      rows.push_back({v.requirement, v.stage, v.value ? number(*v.value) : "no such figure", v.met ? "met" : "failed"});
    html_ += "<h2>Thresholds</h2>";
    table({"threshold", "stage", "measured", ""}, rows);
  }

  void write_capacity(const CapacityReport& capacity) {
    html_ += fmt::format("<h2>Capacity: {} characters{}</h2>", capacity.capacity,
                         capacity.reached_max            ? ", and more was not tried"
                         : capacity.limited_by_generator ? ", as far as this generator can tell"
                                                         : "");
    Chart chart{"Latency over characters", "characters", "ms", true, true, false, {}, {}};
    const std::array<const char*, 3> names{"latency_p50_ms", "latency_p99_ms", "latency_max_ms"};
    for (const char* name : names) {
      ChartLine line{name, {}};
      for (const CapacityPoint& point : capacity.points) {
        const auto found = point.figures.find(name);
        if (found != point.figures.end()) line.points.emplace_back(point.probe.characters, found->second);
      }
      std::ranges::sort(line.points);
      chart.lines.push_back(std::move(line));
    }
    html_ += "<div class=\"charts\">" + draw(chart) + "</div>";
    std::vector<std::vector<std::string>> rows;
    for (const CapacityPoint& point : capacity.points) {
      std::vector<std::string> row{
          std::to_string(point.probe.characters),
          std::string(point.probe.passed ? "passed" : "failed") + (point.probe.confirms ? ", confirming" : "")};
      for (const char* name : {"latency_p50_ms", "latency_p99_ms", "frames_missed_share", "server_cpu_cores",
                               "generator_cpu_cores", "generator_lag_p99_ms"}) {
        const auto found = point.figures.find(name);
        row.push_back(found == point.figures.end() ? "-" : number(found->second));
      }
      rows.push_back(std::move(row));
    }
    table({"characters", "", "latency p50 ms", "latency p99 ms", "missed share", "server cores", "generator cores",
           "generator lag p99 ms"},
          rows);
  }

  void write_run(const RunResult& run) {
    for (const StageResult& stage : run.stages)
      bands_.push_back({stage.begin_s, stage.begin_s + stage.duration_s, stage.stage.name});
    html_ += fmt::format(
        "<h2>The run</h2><p class=\"sub\">{} ticks a second{}{}; the generator's own lag, p99: {:.2f} ms, "
        "trusted up to {:g} ms</p>",
        run.tick_rate_hz, run.ended_early ? ", ended early" : "", run.server_died ? ", the server died" : "",
        run.generator_lag_p99_ms, report_.lag_p99_max_ms);
    html_ += "<div class=\"charts\">";
    write_latency(run);
    write_load(run);
    write_processes(run);
    html_ += "</div>";
    write_figures(run);
    write_ends(run);
    write_metrics(run);
    html_ += "<details><summary>The plan</summary><pre>" + escaped(to_json_text(run.plan)) + "</pre></details>\n";
  }

  // `of`: a window's value.
  template <class Of>
  ChartLine over_time(const RunResult& run, std::string label, Of of) {
    ChartLine line{std::move(label), {}};
    for (const WindowFigures& w : run.windows) line.points.emplace_back(w.begin_s + w.duration_s / 2, of(w));
    return line;
  }
  Chart time_chart(std::string title, std::string y_label) const {
    return {std::move(title), "seconds", std::move(y_label), false, false, false, {}, bands_};
  }

  void write_latency(const RunResult& run) {
    Chart times = time_chart("Latency, from a pose's intended capture to its frame", "ms");
    times.log_y = true;
    times.lines = {over_time(run, "p50", [](const WindowFigures& w) { return w.latency_p50_ms; }),
                   over_time(run, "p99", [](const WindowFigures& w) { return w.latency_p99_ms; }),
                   over_time(run, "max", [](const WindowFigures& w) { return w.latency_max_ms; }),
                   over_time(run, "generator's own lag, max", [](const WindowFigures& w) { return w.lag_max_ms; })};
    html_ += draw(times);
    Chart tail{"Share of poses that waited longer", "ms", "share", true, true, false, {}, {}};
    for (const StageResult& stage : run.stages) {
      if (!stage.stage.measured) continue;
      ChartLine line{stage.stage.name, stage.tally.latency.tail()};
      tail.lines.push_back(std::move(line));
    }
    html_ += draw(tail);
  }

  void write_load(const RunResult& run) {
    Chart levels = time_chart("Levels of detail", "share of frames");
    levels.stacked = true;
    for (std::size_t i = 0; i < kLevelCount; ++i)
      levels.lines.push_back(over_time(run, std::string(kLevelNames[i]), [i](const WindowFigures& w) {
        return w.frames > 0 ? static_cast<double>(w.frames_by_level[i]) / static_cast<double>(w.frames) : 0.0;
      }));
    html_ += draw(levels);
    Chart bytes = time_chart("Bytes", "kB/s");
    const auto rate = [](std::uint64_t count, const WindowFigures& w) {
      return static_cast<double>(count) / w.duration_s / 1e3;
    };
    bytes.lines = {over_time(run, "from the server", [&](const WindowFigures& w) { return rate(w.bytes_in, w); }),
                   over_time(run, "frames alone", [&](const WindowFigures& w) { return rate(w.content_bytes, w); }),
                   over_time(run, "to the server", [&](const WindowFigures& w) { return rate(w.bytes_out, w); })};
    html_ += draw(bytes);
    Chart population = time_chart("Population", "");
    population.lines = {over_time(run, "characters", [](const WindowFigures& w) { return w.characters; }),
                        over_time(run, "clients", [](const WindowFigures& w) { return w.clients; })};
    html_ += draw(population);
    Chart wrong = time_chart("What went wrong", "a second");
    const auto per_s = [](std::uint64_t count, const WindowFigures& w) {
      return static_cast<double>(count) / w.duration_s;
    };
    wrong.lines = {
        over_time(run, "errors", [&](const WindowFigures& w) { return per_s(w.errors, w); }),
        over_time(run, "frames missed", [&](const WindowFigures& w) { return per_s(w.frames_missed, w); }),
        over_time(run, "poses unanswered", [&](const WindowFigures& w) { return per_s(w.poses_unanswered, w); }),
        over_time(run, "poses unsent", [&](const WindowFigures& w) { return per_s(w.poses_unsent, w); })};
    html_ += draw(wrong);
  }

  void write_processes(const RunResult& run) {
    Chart cpu = time_chart("Processor", "cores");
    Chart memory = time_chart("Memory", "MiB resident");
    cpu.lines = {{"server", {}}, {"generator", {}}};
    memory.lines = cpu.lines;
    for (const ProcessPoint& p : run.processes) {
      if (p.server_resident_mib > 0) {
        cpu.lines[0].points.emplace_back(p.at_s, p.server_cpu_cores);
        memory.lines[0].points.emplace_back(p.at_s, p.server_resident_mib);
      }
      cpu.lines[1].points.emplace_back(p.at_s, p.generator_cpu_cores);
      memory.lines[1].points.emplace_back(p.at_s, p.generator_resident_mib);
    }
    html_ += draw(cpu) + draw(memory);
  }

  // Figures down, stages across.
  void write_figures(const RunResult& run) {
    std::vector<std::string> head{""};
    std::set<std::string> names;
    for (const StageResult& stage : run.stages) {
      head.push_back(stage.stage.name + (stage.stage.measured ? "" : " (not measured)"));
      for (const auto& [name, value] : stage.figures) names.insert(name);
    }
    std::vector<std::vector<std::string>> rows;
    for (const std::string& name : names) {
      std::vector<std::string> row{name};
      for (const StageResult& stage : run.stages) {
        const auto found = stage.figures.find(name);
        row.push_back(found == stage.figures.end() ? "" : number(found->second));
      }
      rows.push_back(std::move(row));
    }
    html_ += "<h2>Figures by stage</h2>";
    table(head, rows);
    html_ += "<details><summary>What they mean</summary>";
    std::vector<std::vector<std::string>> meanings;
    for (const FigureName& figure : figure_names())
      meanings.push_back({std::string(figure.name), std::string(figure.meaning)});
    table({"figure", ""}, meanings);
    html_ += "</details>";
  }

  void write_ends(const RunResult& run) {
    std::vector<std::vector<std::string>> rows;
    for (const StageResult& stage : run.stages) {
      for (const auto& [reason, count] : stage.tally.counts.errors)
        rows.push_back({stage.stage.name, "well-behaved", reason, std::to_string(count)});
      for (const auto& [end, count] : stage.tally.counts.bad_client_ends)
        rows.push_back({stage.stage.name, "misbehaving", end, std::to_string(count)});
    }
    for (const auto& [failure, count] : run.check_failures)
      rows.push_back({"", "check", failure, std::to_string(count)});
    if (rows.empty()) return;
    html_ += "<h2>Errors and refusals</h2>";
    table({"stage", "clients", "reason", "times"}, rows);
  }

  void write_metrics(const RunResult& run) {
    std::vector<std::vector<std::string>> threads;
    for (const StageResult& stage : run.stages) {
      if (stage.duration_s <= 0) continue;
      for (const auto& [name, cpu_s] : stage.server.thread_cpu_s)
        threads.push_back({stage.stage.name, name, number(cpu_s / stage.duration_s)});
    }
    if (!threads.empty()) {
      html_ += "<h2>Server, by thread</h2>";
      table({"stage", "thread", "cores"}, threads);
    }
    for (const StageResult& stage : run.stages) {
      if (stage.server_metrics.empty()) continue;
      std::vector<std::vector<std::string>> rows;
      for (const auto& [sample, value] : stage.server_metrics)
        if (sample.find("_bucket{") == std::string::npos && value != 0) rows.push_back({sample, number(value)});
      html_ += fmt::format("<details><summary>Server's metrics: {} (counters: what was added)</summary>",
                           escaped(stage.stage.name));
      table({"metric", "value"}, rows);
      html_ += "</details>";
    }
  }

  const Report& report_;
  std::string html_;
  std::vector<ChartBand> bands_;
};

}  // namespace

std::string to_page(const Report& report) {
  return Page(report).write();
}

}  // namespace hairnet::load
