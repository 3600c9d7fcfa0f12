#include "tests/load/svg_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hairnet::load {
namespace {

// The size of a chart and the margins around its plot, pixels. The page has eight colours, --c0 to --c7
// (html_page.cpp).
constexpr double kWidth = 760, kHeight = 240, kLeft = 62, kRight = 12, kTop = 24, kBottom = 34;
constexpr std::size_t kColourCount = 8;

// One axis: values from `least` to `most` lie on the page from `begin` to `end`, pixels. On a logarithmic axis only
// positive values are shown.
struct Axis {
  double least = 0, most = 1;
  bool logarithmic = false;
  double begin = 0, end = 1;  // on the page

  [[nodiscard]] bool shows(double value) const { return std::isfinite(value) && (!logarithmic || value > 0); }
  [[nodiscard]] double at(double value) const {
    const auto map = [&](double v) { return logarithmic ? std::log10(v) : v; };
    const double share = (map(value) - map(least)) / (map(most) - map(least));
    return begin + (end - begin) * std::clamp(share, 0.0, 1.0);
  }
};

std::string number(double value) {
  const double size = std::abs(value);
  if (size >= 1e6) return fmt::format("{:.3g}M", value / 1e6);
  if (size >= 1e4) return fmt::format("{:.3g}k", value / 1e3);
  return fmt::format("{:.4g}", value);
}

// Each line with those before it added.
std::vector<ChartLine> stacked(std::vector<ChartLine> lines) {
  for (std::size_t i = 1; i < lines.size(); ++i) {
    for (std::size_t k = 0; k < lines[i].points.size() && k < lines[i - 1].points.size(); ++k)
      lines[i].points[k].second += lines[i - 1].points[k].second;
  }
  return lines;
}

// Makes the axis that all points fit on. A linear y axis begins at 0, or below, and has 5 % of room above; a
// logarithmic axis has whole decades.
Axis fit(const std::vector<ChartLine>& lines, bool is_x, bool logarithmic) {
  double least = std::numeric_limits<double>::max(), most = std::numeric_limits<double>::lowest();
  for (const ChartLine& line : lines) {
    for (const auto& [x, y] : line.points) {
      const double value = is_x ? x : y;
      if (!std::isfinite(value) || (logarithmic && value <= 0)) continue;
      least = std::min(least, value);
      most = std::max(most, value);
    }
  }
  Axis axis;
  axis.logarithmic = logarithmic;
  if (least > most) return axis;
  if (logarithmic) {
    axis.least = std::pow(10, std::floor(std::log10(least)));
    axis.most = std::pow(10, std::ceil(std::log10(most)));
    if (axis.most <= axis.least) axis.most = axis.least * 10;
    return axis;
  }
  axis.least = is_x ? least : std::min(0.0, least);
  axis.most = most > axis.least ? most : axis.least + 1;
  if (!is_x) axis.most += 0.05 * (axis.most - axis.least);
  return axis;
}

// Returns the path of a line in SVG's letters: M moves the pen, L draws. A point that cannot be shown interrupts the
// line.
std::string path(const ChartLine& line, const Axis& x, const Axis& y) {
  std::string d;
  bool pen_down = false;
  for (const auto& [px, py] : line.points) {
    if (!x.shows(px) || !y.shows(py)) {
      pen_down = false;
      continue;
    }
    d += fmt::format("{}{:.1f} {:.1f}", pen_down ? "L" : "M", x.at(px), y.at(py));
    pen_down = true;
  }
  return d;
}

// Returns the path around the area between two lines: along the upper one, and back along the lower one or the axis.
std::string area(const ChartLine& upper, const ChartLine* lower, const Axis& x, const Axis& y) {
  std::string d = path(upper, x, y);
  if (d.empty()) return d;
  for (auto point = upper.points.rbegin(); point != upper.points.rend(); ++point) {
    const auto index = static_cast<std::size_t>(upper.points.rend() - point) - 1;
    const double base = lower && index < lower->points.size() ? lower->points[index].second : 0;
    d += fmt::format("L{:.1f} {:.1f}", x.at(point->first), y.at(base));
  }
  return d + "Z";
}

std::string draw_grid(const Chart& chart, const Axis& x, const Axis& y) {
  std::string svg;
  bool shaded = false;
  for (const ChartBand& band : chart.bands) {
    const double from = x.at(band.from), to = x.at(band.to);
    if (std::exchange(shaded, !shaded))
      svg += fmt::format(R"(<rect class="band" x="{:.1f}" y="{}" width="{:.1f}" height="{}"/>)", from, kTop,
                         std::max(0.0, to - from), kHeight - kTop - kBottom);
    // A letter is about 6 pixels wide; a label that does not fit its band is left out.
    if (to - from > 6.0 * static_cast<double>(band.label.size()))
      svg += fmt::format(R"(<text class="note" x="{:.1f}" y="{}">{}</text>)", from + 3, kTop - 3, escaped(band.label));
  }
  for (const double value : ticks(y.least, y.most, 5, y.logarithmic)) {
    if (value < y.least || value > y.most) continue;
    svg += fmt::format(R"(<line class="grid" x1="{}" x2="{}" y1="{:.1f}" y2="{:.1f}"/>)", kLeft, kWidth - kRight,
                       y.at(value), y.at(value));
    svg += fmt::format(R"(<text class="tick" text-anchor="end" x="{}" y="{:.1f}">{}</text>)", kLeft - 5,
                       y.at(value) + 4, number(value));
  }
  for (const double value : ticks(x.least, x.most, 8, x.logarithmic)) {
    if (value < x.least || value > x.most) continue;
    svg += fmt::format(R"(<text class="tick" text-anchor="middle" x="{:.1f}" y="{}">{}</text>)", x.at(value),
                       kHeight - kBottom + 14, number(value));
  }
  svg += fmt::format(R"(<text class="tick" text-anchor="middle" x="{}" y="{}">{}</text>)", kWidth / 2, kHeight - 4,
                     escaped(chart.x_label));
  svg += fmt::format(R"(<text class="tick" x="{}" y="{}">{}</text>)", 2, kTop - 13, escaped(chart.y_label));
  return svg;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      case '\'':
        safe += "&#39;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

// Steps are 1, 2 or 5 times a power of ten, such that about `count` fit.
std::vector<double> ticks(double least, double most, int count, bool logarithmic) {
  std::vector<double> values;
  if (!std::isfinite(least) || !std::isfinite(most) || most <= least) return values;
  if (logarithmic) {
    if (least <= 0) return values;
    for (double e = std::floor(std::log10(least)); e <= std::ceil(std::log10(most)); ++e)
      values.push_back(std::pow(10, e));
    return values;
  }
  const double rough = (most - least) / count, scale = std::pow(10, std::floor(std::log10(rough)));
  double step = scale * 10;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * scale >= rough) {
      step = factor * scale;
      break;
    }
  }
  for (double value = std::ceil(least / step) * step; value <= most + step * 1e-9; value += step)
    values.push_back(std::abs(value) < step * 1e-9 ? 0 : value);
  return values;
}

std::string draw(const Chart& chart) {
  std::string html = fmt::format("<figure><figcaption>{}</figcaption>", escaped(chart.title));
  const bool empty = std::ranges::all_of(chart.lines, [](const ChartLine& line) { return line.points.empty(); });
  if (empty) return html + "<p>nothing to show</p></figure>\n";
  const std::vector<ChartLine> lines = chart.stacked ? stacked(chart.lines) : chart.lines;
  Axis x = fit(lines, true, chart.log_x), y = fit(lines, false, chart.log_y);
  x.begin = kLeft;
  x.end = kWidth - kRight;
  y.begin = kHeight - kBottom;
  y.end = kTop;
  html += fmt::format(R"(<svg viewBox="0 0 {} {}" role="img" aria-label="{}">)", kWidth, kHeight, escaped(chart.title));
  html += draw_grid(chart, x, y);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string shape =
        chart.stacked ? area(lines[i], i > 0 ? &lines[i - 1] : nullptr, x, y) : path(lines[i], x, y);
    if (shape.empty()) continue;
    html += fmt::format(R"svg(<path class="{}" style="--c:var(--c{})" d="{}"/>)svg", chart.stacked ? "area" : "line",
                        i % kColourCount, shape);
  }
  html += "</svg><p class=\"legend\">";
  for (std::size_t i = 0; i < lines.size(); ++i)
    html += fmt::format(R"svg(<span style="--c:var(--c{})">{}</span>)svg", i % kColourCount, escaped(lines[i].label));
  return html + "</p></figure>\n";
}

}  // namespace hairnet::load
