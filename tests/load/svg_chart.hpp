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
  std::vector<std::pair<double, double>> points;  // x ascending; a value that is not finite breaks the line
};
struct ChartBand {
  double from = 0, to = 0;
  std::string label;
};
struct Chart {
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;  // then values of 0 and below are left out
  bool stacked = false;               // areas on one another, in order; all lines have the same x
  std::vector<ChartLine> lines;
  std::vector<ChartBand> bands;  // parts of the x axis, shaded in turn
};

// One <figure> with an inline <svg>, its axes, grid and legend; styled by the page's variables --ink, --faint, --grid
// and
// --c0 to --c7. Says "nothing to show" when there is no point.
std::string draw(const Chart& chart);

// About `count` round numbers that span the values; powers of ten for a logarithmic axis.
std::vector<double> ticks(double least, double most, int count, bool logarithmic);

}  // namespace hairnet::load
