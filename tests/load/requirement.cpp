#include "tests/load/requirement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace hairnet::load {
namespace {

using Relation = Requirement::Relation;
// The longer signs stand first, since the search takes the first one that fits: "<=" also begins with "<".
constexpr std::array<std::pair<std::string_view, Relation>, 5> kRelations{{{"<=", Relation::less_equal},
                                                                           {">=", Relation::greater_equal},
                                                                           {"==", Relation::equal},
                                                                           {"<", Relation::less},
                                                                           {">", Relation::greater}}};

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

bool is_name(std::string_view text) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
  };
  return !text.empty() && std::ranges::all_of(text, plain);
}

}  // namespace

Result<Requirement> parse_requirement(std::string_view text) {
  const auto wrong = [&](std::string_view error) {
    return Refusal(
        fmt::format("requirement '{}': {}; it looks like latency_p99_ms<40 or storm/errors==0", text, error));
  };
  const std::size_t at = text.find_first_of("<>=");
  if (at == std::string_view::npos) return wrong("has none of < <= > >= ==");
  const auto known = std::ranges::find_if(
      kRelations, [&](const auto& relation) { return text.substr(at).starts_with(relation.first); });
  if (known == kRelations.end()) return wrong("has none of < <= > >= ==");
  Requirement found;
  found.text = text;
  found.relation = known->second;
  std::string_view figure = trimmed(text.substr(0, at));
  if (const std::size_t slash = figure.find('/'); slash != std::string_view::npos) {
    found.stage = figure.substr(0, slash);
    if (!is_name(found.stage)) return wrong("names no stage before the /");
    figure.remove_prefix(slash + 1);
  }
  if (!is_name(figure)) return wrong("names no figure");
  found.figure = figure;
  const std::string_view bound = trimmed(text.substr(at + known->first.size()));
  const auto [end, error] = std::from_chars(bound.data(), bound.data() + bound.size(), found.bound);
  if (error != std::errc() || end != bound.data() + bound.size() || !std::isfinite(found.bound))
    return wrong("has no number as its bound");
  return found;
}

bool is_met(const Requirement& requirement, double value) {
  switch (requirement.relation) {
    case Relation::less:
      return value < requirement.bound;
    case Relation::less_equal:
      return value <= requirement.bound;
    case Relation::greater:
      return value > requirement.bound;
    case Relation::greater_equal:
      return value >= requirement.bound;
    case Relation::equal:
      return value == requirement.bound;
  }
  return false;
}

std::vector<Verdict> judge(const std::vector<Requirement>& requirements, const std::vector<NamedFigures>& stages) {
  std::vector<Verdict> verdicts;
  for (const Requirement& requirement : requirements) {
    bool judged = false;
    for (const NamedFigures& stage : stages) {
      // A threshold without a stage holds for all measured stages. One with a stage also holds for a stage that is not
      // measured.
      if (requirement.stage.empty() ? !stage.measured : requirement.stage != stage.stage) continue;
      judged = true;
      Verdict verdict{requirement.text, stage.stage, std::nullopt, false};
      if (const auto found = stage.figures->find(requirement.figure); found != stage.figures->end()) {
        verdict.value = found->second;
        verdict.met = is_met(requirement, found->second);
      }
      verdicts.push_back(std::move(verdict));
    }
    // No stage has the name, for example after a typing error. A threshold that is never checked must not pass.
    if (!judged) verdicts.push_back({requirement.text, requirement.stage, std::nullopt, false});
  }
  return verdicts;
}

}  // namespace hairnet::load
