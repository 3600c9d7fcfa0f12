#include "tests/fidelity/decimation_report.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>

namespace hairnet::fidelity {
namespace {

std::string text(const char* format, auto... values) {
  char line[512];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

// The mean of the rows of all hairstyles and motions with the same lattice and the same number of springs.
struct Mean {
  std::size_t count = 0;
  Distance merged, random;
};

Mean mean_of(const std::vector<DecimationRow>& rows, int nodes, std::size_t spring_count) {
  Mean mean;
  for (const DecimationRow& row : rows) {
    if (row.lattice_nodes != nodes || row.spring_count != spring_count) continue;
    ++mean.count;
    mean.merged.rms += row.merged.rms;
    mean.merged.p95 += row.merged.p95;
    mean.random.rms += row.random.rms;
    mean.random.p95 += row.random.p95;
  }
  const double share = mean.count > 0 ? 1 / static_cast<double>(mean.count) : 0;
  for (double* value : {&mean.merged.rms, &mean.merged.p95, &mean.random.rms, &mean.random.p95}) *value *= share;
  return mean;
}

// `random / merged` says how many times more a random choice of stiffeners errs than merging them.
std::string means_table(const DecimationReport& report) {
  std::string table =
      "| lattice | springs + attachments | merged RMS | p95 | random RMS | p95 | random / merged |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const int nodes : kLatticeNodes) {
    for (const std::size_t count : kSpringCounts) {
      const Mean mean = mean_of(report.rows, nodes, count);
      if (mean.count == 0) continue;
      table +=
          text("| %d³ | %zu + %zu | %.3f | %.3f | %.3f | %.3f | %.2f |\n", nodes, count, count / 4, mean.merged.rms,
               mean.merged.p95, mean.random.rms, mean.random.p95, mean.random.rms / mean.merged.rms);
    }
  }
  return table;
}

// One row for each hairstyle and motion at the target: those rows have a figure `stiffer_rms`.
std::string target_table(const DecimationReport& report) {
  std::string table =
      "| hairstyle | motion | all | motion, mm | merged RMS | p95 | random RMS | ratio | all, 1 % stiffer |\n"
      "|---|---|---|---|---|---|---|---|---|\n";
  for (const DecimationRow& row : report.rows) {
    if (!row.stiffer_rms) continue;
    table += text("| %s | %s | %zu + %zu | %.1f | %.3f | %.3f | %.3f | %.2f | %.3f |\n", row.groom.c_str(),
                  row.motion.c_str(), row.spring_count_all, row.attachment_count_all, 1e3 * row.motion_m,
                  row.merged.rms, row.merged.p95, row.random.rms, row.random.rms / row.merged.rms, *row.stiffer_rms);
  }
  return table;
}

std::string lattice_table(const DecimationReport& report) {
  std::string table = "| hairstyle | motion | lattice, all stiffeners | RMS | p95 |\n|---|---|---|---|---|\n";
  for (const LatticeRow& row : report.lattices) {
    table += text("| %s | %s | %d³ against %d³ | %.3f | %.3f |\n", row.groom.c_str(), row.motion.c_str(),
                  row.lattice_nodes, row.truth_nodes, row.distance.rms, row.distance.p95);
  }
  return table;
}

nlohmann::json json_of(const Distance& distance) {
  return {{"rms", distance.rms}, {"p95", distance.p95}};
}

// The plot's frame, pixels.
constexpr double kLeft = 60, kRight = 620, kTop = 30, kBottom = 360;

struct Axes {
  double error_max = 0;
  [[nodiscard]] double x(std::size_t count) const {
    // The x axis is logarithmic, from the least to the largest of kSpringCounts. The y axis is the error as a share of
    // the motion.
    const double first = std::log2(200.0), last = std::log2(1600.0);
    return kLeft + 20 + (kRight - kLeft - 40) * (std::log2(static_cast<double>(count)) - first) / (last - first);
  }
  [[nodiscard]] double y(double error) const { return kBottom - (kBottom - kTop) * error / error_max; }
};

std::string line_of(const Axes& axes, std::span<const std::pair<std::size_t, double>> points, const char* style) {
  std::string line = "<polyline fill=\"none\" stroke-width=\"2\" " + std::string(style) + " points=\"";
  for (const auto& [count, error] : points) line += text("%.1f,%.1f ", axes.x(count), axes.y(error));
  return line + "\"/>\n";
}

// A line for each 10 % of error, and a label for each count: springs + attachments, of which there are a quarter as
// many.
std::string grid_of(const Axes& axes) {
  std::string grid;
  for (double error = 0; error <= axes.error_max + 1e-9; error += 0.1) {
    grid += text("<line x1=\"%.0f\" x2=\"%.0f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/>\n", kLeft, kRight,
                 axes.y(error), axes.y(error));
    grid += text("<text x=\"%.0f\" y=\"%.1f\" text-anchor=\"end\">%.0f %%</text>\n", kLeft - 6, axes.y(error) + 4,
                 100 * error);
  }
  for (const std::size_t count : kSpringCounts) {
    grid += text("<text x=\"%.1f\" y=\"%.0f\" text-anchor=\"middle\">%zu + %zu</text>\n", axes.x(count), kBottom + 18,
                 count, count / 4);
  }
  return grid;
}

}  // namespace

std::string tables_of(const DecimationReport& report) {
  if (report.rows.empty()) return lattice_table(report);
  std::string tables = means_table(report) + "\n" + target_table(report);
  const Mean target = mean_of(report.rows, kTargetNodes, kTargetSpringCount);
  if (target.count > 0) {
    tables += text(
        "\n%zu + %zu on %d³: RMS error %.1f %% of the motion (aim %.0f %%), %.2f times less than random (least %.1f, "
        "aim %.0f)\n",
        kTargetSpringCount, kTargetSpringCount / 4, kTargetNodes, 100 * target.merged.rms, 100 * kMerged_rms_aim,
        target.random.rms / target.merged.rms, kRandom_ratio_min, kRandom_ratio_aim);
  }
  return tables;
}

std::string json_of(const DecimationReport& report) {
  nlohmann::json json{{"decimation", nlohmann::json::array()}, {"lattices", nlohmann::json::array()}};
  for (const DecimationRow& row : report.rows) {
    nlohmann::json entry{{"groom", row.groom},
                         {"motion", row.motion},
                         {"lattice_nodes", row.lattice_nodes},
                         {"spring_count", row.spring_count},
                         {"attachment_count", row.attachment_count},
                         {"spring_count_all", row.spring_count_all},
                         {"attachment_count_all", row.attachment_count_all},
                         {"motion_m", row.motion_m},
                         {"merged", json_of(row.merged)},
                         {"random", json_of(row.random)}};
    if (row.stiffer_rms) entry["stiffer_rms"] = *row.stiffer_rms;
    json["decimation"].push_back(std::move(entry));
  }
  for (const LatticeRow& row : report.lattices) {
    json["lattices"].push_back({{"groom", row.groom},
                                {"motion", row.motion},
                                {"lattice_nodes", row.lattice_nodes},
                                {"truth_nodes", row.truth_nodes},
                                {"motion_m", row.motion_m},
                                {"distance", json_of(row.distance)}});
  }
  return json.dump(1) + "\n";
}

std::string plot_of(const DecimationReport& report) {
  constexpr const char* kColours[] = {"#c0392b", "#2471a3", "#1e8449"};
  Axes axes;
  for (const int nodes : kLatticeNodes) {
    for (const std::size_t count : kSpringCounts) {
      axes.error_max = std::max(axes.error_max, mean_of(report.rows, nodes, count).random.rms);
    }
  }
  // The y axis ends at the next 10 % above the largest error.
  axes.error_max = 0.1 * std::max(1.0, std::ceil(10 * axes.error_max));
  std::string plot =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 640 400\" font-family=\"sans-serif\" "
      "font-size=\"12\">\n<rect width=\"640\" height=\"400\" fill=\"#fff\"/>\n"
      "<text x=\"60\" y=\"18\">RMS error over RMS motion: merged (full line), random part made stiffer "
      "(dashed)</text>\n";
  plot += grid_of(axes);
  for (std::size_t i = 0; i < std::size(kLatticeNodes); ++i) {
    std::vector<std::pair<std::size_t, double>> merged, random;
    for (const std::size_t count : kSpringCounts) {
      const Mean mean = mean_of(report.rows, kLatticeNodes[i], count);
      if (mean.count == 0) continue;
      merged.emplace_back(count, mean.merged.rms);
      random.emplace_back(count, mean.random.rms);
    }
    const std::string stroke = text("stroke=\"%s\"", kColours[i]);
    plot += line_of(axes, merged, stroke.c_str());
    plot += line_of(axes, random, (stroke + " stroke-dasharray=\"6 4\"").c_str());
    plot += text("<text x=\"%.0f\" y=\"%.0f\" fill=\"%s\">%d³</text>\n", kRight - 30,
                 kTop + 16.0 * static_cast<double>(i + 1), kColours[i], kLatticeNodes[i]);
  }
  return plot + "</svg>\n";
}

}  // namespace hairnet::fidelity
