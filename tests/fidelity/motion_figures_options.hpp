#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "core/solver/wind.hpp"
#include "tests/fidelity/motion_figures_measure.hpp"

namespace hairnet::fidelity {

struct MotionFigureFlags {
  std::vector<std::string> grooms, motions, level_names;
  // The name of a set of motions.
  std::string set = "everyday";
  Wind wind;
  std::vector<LevelIndex> levels{LevelIndex::high, LevelIndex::low};
  double rate_hz = 30, duration_s = 12;
  MotionFigureOptions measure;
  bool picture = false;
  std::string json;
};

// `flags` must outlive the parsing.
void add_motion_figure_flags(CLI::App& app, MotionFigureFlags& flags);
// Fills in what was not given. Throws CLI::ValidationError for what CLI11 cannot check.
void complete(MotionFigureFlags& flags);

}  // namespace hairnet::fidelity
