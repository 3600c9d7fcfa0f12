#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace hairnet::load {

// Figures by name; those of a stage in the report.
using Figures = std::map<std::string, double>;

// A threshold: [STAGE/]FIGURE<NUMBER with <, <=, >, >= or ==. Without a stage it is of every measured one.
struct Requirement {
  enum class Relation : std::uint8_t { less, less_equal, greater, greater_equal, equal };
  std::string text;
  std::string stage;  // empty: every measured one
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
  std::optional<double> value;  // none: there is no such figure, which is a failure
  bool met = false;
};
// One a requirement and stage it is of; one without a stage where there is none.
std::vector<Verdict> judge(const std::vector<Requirement>& requirements, const std::vector<NamedFigures>& stages);

}  // namespace hairnet::load
