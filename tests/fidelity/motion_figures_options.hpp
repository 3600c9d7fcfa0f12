#pragma once

#include <string>
#include <variant>
#include <vector>

#include "tests/fidelity/motion_figures_measure.hpp"

namespace hairnet::fidelity {

struct MotionFigureFlags {
  std::vector<std::string> grooms, motions;
  std::vector<LevelIndex> levels{LevelIndex::high, LevelIndex::low};
  double rate_hz = 30, duration_s = 12;
  MotionFigureOptions measure;
  bool picture = false;
  std::string json;
};

// Or the exit status, when there is nothing to be done.
std::variant<MotionFigureFlags, int> parse_motion_figure_flags(int argc, char** argv);

}  // namespace hairnet::fidelity
