#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace hairnet::load {

// The figures of a stage, by name (figure_names() in stage_figures.hpp).
using Figures = std::map<std::string, double>;

// A threshold, written as [STAGE/]FIGURE<NUMBER, where < may also be <=, >, >= or ==. Without a stage it holds for
// every measured stage.
struct Requirement {
  enum class Relation : std::uint8_t { less, less_equal, greater, greater_equal, equal };
  std::string text;
  // It is empty for a threshold of every measured stage.
  std::string stage;
  std::string figure;
  Relation relation = Relation::less;
  double bound = 0;
};
Result<Requirement> parse_requirement(std::string_view text);
bool is_met(const Requirement& requirement, double value);

struct NamedFigures {
  std::string stage;
  bool measured = true;
  const Figures* figures = nullptr;
};
struct Verdict {
  std::string requirement, stage;
  // It is empty when the stage has no such figure, which counts as a failure.
  std::optional<double> value;
  bool met = false;
};
// Returns a verdict for each requirement and each stage that it holds for. A requirement whose stage does not exist
// gets one verdict without a stage, which is a failure.
std::vector<Verdict> judge(const std::vector<Requirement>& requirements, const std::vector<NamedFigures>& stages);

}  // namespace hairnet::load
