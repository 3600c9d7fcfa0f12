#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hairnet::load {

// For HTML and SVG: & < > " and ' as entities.
std::string escaped(std::string_view text);

struct ChartLine {
  std::string label;
  // The points (x, y) with ascending x. A y that is not finite breaks the line.
  std::vector<std::pair<double, double>> points;
};
struct ChartBand {
  double from = 0, to = 0;
  std::string label;
};
struct Chart {
  std::string title, x_label, y_label;
  // A logarithmic axis leaves out values of 0 and below.
  bool log_x = false, log_y = false;
  // The lines are drawn as areas on top of one another, in order. All must have the same x.
  bool stacked = false;
  std::vector<ChartLine> lines;
  // Parts of the x axis, such as stages, of which every second one is shaded.
  std::vector<ChartBand> bands;
};

// Returns one <figure> with an inline <svg>, its axes, grid and legend. The page's variables --ink, --faint, --grid and
// --c0 to --c7 give the colours. The figure says "nothing to show" when there is no point.
std::string draw(const Chart& chart);

// Returns the marks of an axis: about `count` round numbers that span the values, or powers of ten on a logarithmic
// axis.
std::vector<double> ticks(double least, double most, int count, bool logarithmic);

}  // namespace hairnet::load
