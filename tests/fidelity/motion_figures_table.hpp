#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "tests/fidelity/motion_figures_measure.hpp"

namespace hairnet::fidelity {

// In Markdown: a row for each run, then for each level the mean and the worst over each set of motions.
std::string motion_figure_tables(std::span<const MotionFigures> all);

nlohmann::ordered_json motion_figure_json(std::span<const MotionFigures> all);

// The commands of hairnet-view that draw the worst depth, length and jump of each level, of made hair in made motions.
std::string picture_commands(std::span<const MotionFigures> all, double duration_s);

}  // namespace hairnet::fidelity
