#include "tests/fidelity/collisions_table.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace hairnet::fidelity {
namespace {

// Over the ticks of several runs.
Depths& operator+=(Depths& sum, const Depths& run) {
  const auto a = static_cast<double>(sum.ticks), b = static_cast<double>(run.ticks), all = std::max(1.0, a + b);
  const auto join = [&](double& x, double y) { x = (a * x + b * y) / all; };
  join(sum.mean_share, run.mean_share);
  join(sum.mean_share_inside, run.mean_share_inside);
  for (std::size_t i = 0; i < kBoneCount; ++i) join(sum.mean_share_by_bone[i], run.mean_share_by_bone[i]);
  sum.worst_share = std::max(sum.worst_share, run.worst_share);
  sum.deepest_m = std::max(sum.deepest_m, run.deepest_m);
  sum.ticks += run.ticks;
  return sum;
}

struct Row {
  std::string name;
  LevelIndex level;
  Depths without, with;
};

// Rows in the order of first appearance.
std::vector<Row> rows_by(std::span<const Depths> all, std::string Depths::*name) {
  std::vector<Row> rows;
  for (const Depths& run : all) {
    auto row = std::ranges::find_if(rows, [&](const Row& r) { return r.name == run.*name && r.level == run.level; });
    if (row == rows.end()) row = rows.insert(rows.end(), {run.*name, run.level, {}, {}});
    (run.metaballs ? row->with : row->without) += run;
  }
  return rows;
}

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char line[256];
  std::snprintf(line, sizeof line, pattern, values...);
  return line;
}

std::string table(const char* first, const std::vector<Row>& rows) {
  std::string text = format("| %s | level | without: mean %% | worst %% | with: mean %% | worst %% |", first);
  text += " head | neck | shoulders | trunk | by nodes inside | deepest mm |\n|---|---|";
  for (int i = 0; i < 10; ++i) text += "--:|";
  text += "\n";
  for (const Row& row : rows) {
    const auto& by_bone = row.with.mean_share_by_bone;
    text += format("| %s | %s | %.2f | %.1f | **%.2f** | %.1f | %.2f | %.2f | %.2f | %.2f | %.2f | %.0f |\n",
                   row.name.c_str(), std::string(kLevelNames[static_cast<std::size_t>(row.level)]).c_str(),
                   100 * row.without.mean_share, 100 * row.without.worst_share, 100 * row.with.mean_share,
                   100 * row.with.worst_share, 100 * by_bone[0], 100 * by_bone[1], 100 * (by_bone[2] + by_bone[3]),
                   100 * by_bone[4], 100 * row.with.mean_share_inside, 1000 * row.with.deepest_m);
  }
  return text;
}

}  // namespace

std::string depth_tables(std::span<const Depths> all) {
  return table("hairstyle", rows_by(all, &Depths::groom)) + "\n" + table("motion", rows_by(all, &Depths::motion));
}

std::string depths_json(std::span<const Depths> all) {
  nlohmann::json runs = nlohmann::json::array();
  for (const Depths& run : all) {
    nlohmann::json by_bone;
    for (std::size_t b = 0; b < kBoneCount; ++b) by_bone[std::string(kBoneNames[b])] = run.mean_share_by_bone[b];
    runs.push_back({{"groom", run.groom},
                    {"motion", run.motion},
                    {"level", kLevelNames[static_cast<std::size_t>(run.level)]},
                    {"metaballs", run.metaballs},
                    {"ticks", run.ticks},
                    {"mean_share", run.mean_share},
                    {"worst_share", run.worst_share},
                    {"mean_share_by_bone", by_bone},
                    {"mean_share_inside", run.mean_share_inside},
                    {"deepest_m", run.deepest_m}});
  }
  return nlohmann::json{{"too_deep_m", kTooDeep_m}, {"runs", runs}}.dump(1) + "\n";
}

}  // namespace hairnet::fidelity
