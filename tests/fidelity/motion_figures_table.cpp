#include "tests/fidelity/motion_figures_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/fidelity/motion_sets.hpp"

namespace hairnet::fidelity {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// A figure of a run as a column of the table. `key` is its name in JSON. The table shows the value times `scale` with
// `digits` decimals; JSON has the value itself.
struct Column {
  const char *title, *key;
  double scale;
  int digits;
  double (*value)(const MotionFigures&);
};

double at_rest(const MotionFigures& run, double RestFigures::*figure) {
  return run.rest ? (*run.rest).*figure : kNone;
}

constexpr double kPercent = 100, kMillimetres = 1000, kDegrees = 180 / std::numbers::pi;

constexpr std::array<Column, 16> kColumns{{
    {"deep: mean %", "deep_share", kPercent, 2, [](const MotionFigures& r) { return r.deep_share; }},
    {"worst %", "deep_share_worst", kPercent, 1, [](const MotionFigures& r) { return r.deep.value; }},
    {"at s", "deep_worst_s", 1, 1, [](const MotionFigures& r) { return r.deep.time_s; }},
    {"length: p50", "length_p50", 1, 3, [](const MotionFigures& r) { return r.length_p50; }},
    {"p99", "length_p99", 1, 2, [](const MotionFigures& r) { return r.length_p99; }},
    {"max", "length_max", 1, 2, [](const MotionFigures& r) { return r.length.value; }},
    {"drawn: p99", "drawn_p99", 1, 2, [](const MotionFigures& r) { return r.drawn_p99; }},
    {"jump: p99.9 mm", "jump_p999_m", kMillimetres, 1, [](const MotionFigures& r) { return r.jump_p999_m; }},
    {"max mm", "jump_max_m", kMillimetres, 0, [](const MotionFigures& r) { return r.jump_m.value; }},
    {"at s", "jump_max_s", 1, 1, [](const MotionFigures& r) { return r.jump_m.time_s; }},
    {"hangs at °", "hanging_rad", kDegrees, 1, [](const MotionFigures& r) { return r.hanging_rad; }},
    {"rest: mm/s", "rest_speed_m_per_s", kMillimetres, 2,
     [](const MotionFigures& r) { return at_rest(r, &RestFigures::speed_m_per_s); }},
    {"deep %", "rest_deep_share", kPercent, 2,
     [](const MotionFigures& r) { return at_rest(r, &RestFigures::deep_share); }},
    {"RMS mm", "rest_rms_m", kMillimetres, 2, [](const MotionFigures& r) { return at_rest(r, &RestFigures::rms_m); }},
    {"p99 mm", "rest_p99_m", kMillimetres, 1, [](const MotionFigures& r) { return at_rest(r, &RestFigures::p99_m); }},
    {"inverted %", "rest_inverted_share", kPercent, 2,
     [](const MotionFigures& r) { return at_rest(r, &RestFigures::inverted_share); }},
}};

// Times of worst values have no mean, so rows of several runs leave them out.
bool is_time(const Column& column) {
  return std::string_view(column.key).ends_with("_s") && std::string_view(column.title) == "at s";
}

std::string_view level_name(const MotionFigures& run) {
  return kLevelNames[static_cast<std::size_t>(run.level)];
}

std::string header(const std::string& first_columns, int first_count) {
  std::string text = first_columns, line = "|";
  for (int i = 0; i < first_count; ++i) line += "---|";
  for (const Column& column : kColumns) {
    text += std::string(" ") + column.title + " |";
    line += "--:|";
  }
  return text + "\n" + line + "\n";
}

std::string cell(const Column& column, double value) {
  char text[64];
  std::snprintf(text, sizeof text, " %.*f |", column.digits, column.scale * value);
  return std::isnan(value) ? " |" : text;
}

// A row of the table: for each column `of`, such as the mean, of the values of the runs that have one.
template <class Of>
std::string row(const std::vector<const MotionFigures*>& runs, Of of) {
  std::string text;
  for (const Column& column : kColumns) {
    std::vector<double> values;
    for (const MotionFigures* run : runs)
      if (const double value = column.value(*run); !std::isnan(value)) values.push_back(value);
    text += values.empty() || (runs.size() > 1 && is_time(column)) ? " |" : cell(column, of(values));
  }
  return text + "\n";
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double worst(const std::vector<double>& values) {
  return *std::ranges::max_element(values);
}

// Rows with the mean and the worst over all motions of a set, for each level that has at least two runs.
std::string set_rows(std::span<const MotionFigures> all, const char* set, std::span<const std::string_view> motions) {
  std::string text;
  for (const std::string_view level : kLevelNames) {
    std::vector<const MotionFigures*> runs;
    for (const MotionFigures& run : all)
      if (level_name(run) == level && std::ranges::find(motions, run.motion) != motions.end()) runs.push_back(&run);
    if (runs.size() < 2) continue;
    const std::string first = "| " + std::string(set) + " | " + std::string(level) + " | ";
    text += first + "mean |" + row(runs, mean) + first + "worst |" + row(runs, worst);
  }
  return text;
}

}  // namespace

std::string motion_figure_tables(std::span<const MotionFigures> all) {
  std::string text = header("| hairstyle | motion | level |", 3);
  for (const MotionFigures& run : all)
    text += "| " + run.groom + " | " + run.motion + " | " + std::string(level_name(run)) + " |" + row({&run}, mean);
  const std::string sets = set_rows(all, "everyday", kEverydayMotions) + set_rows(all, "wild", kWildMotions) +
                           set_rows(all, "postures", kPostures);
  return sets.empty() ? text : text + "\n" + header("| motions | level | |", 3) + sets;
}

nlohmann::ordered_json motion_figure_json(std::span<const MotionFigures> all) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const MotionFigures& run : all) {
    nlohmann::ordered_json& entry = rows.emplace_back();
    entry = {{"groom", run.groom}, {"motion", run.motion}, {"level", level_name(run)}};
    for (const Column& column : kColumns)
      if (const double value = column.value(run); !std::isnan(value)) entry[column.key] = value;
  }
  return rows;
}

// Commands that draw the worst ticks, so that a person can look at them. Only hairstyles and motions of our own can be
// drawn anywhere.
std::string picture_commands(std::span<const MotionFigures> all, double duration_s) {
  std::string text;
  const auto add = [&](std::string_view level, const char* what, Worst MotionFigures::*figure) {
    const MotionFigures* found = nullptr;
    for (const MotionFigures& run : all) {
      const bool is_made = run.groom.starts_with("made:") && run.motion.starts_with("made:");
      if (is_made && level_name(run) == level && (!found || (run.*figure).value > (found->*figure).value)) found = &run;
    }
    if (!found) return;
    char line[512];
    std::snprintf(line, sizeof line,
                  "hairnet-view --local --character groom=%s,motion=%s,level=%s --duration %.1f --times %.2f "
                  "--views front,side,back --sheet %s-%s.png\n",
                  found->groom.c_str(), found->motion.c_str(), std::string(level).c_str(), duration_s,
                  (found->*figure).time_s, what, std::string(level).c_str());
    text += line;
  };
  for (const std::string_view level : kLevelNames) {
    add(level, "deep", &MotionFigures::deep);
    add(level, "long", &MotionFigures::length);
    add(level, "jump", &MotionFigures::jump_m);
  }
  return text;
}

}  // namespace hairnet::fidelity
