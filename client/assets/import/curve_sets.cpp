#include "client/assets/import/curve_sets.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "client/assets/import/text.hpp"
#include "core/groom/groom.hpp"
#include "core/shown_text.hpp"

namespace hairnet {
namespace {

// The points of each curve that is a strand.
struct Sampled {
  std::vector<Vec3f> points;
  std::vector<std::uint32_t> begin{0};
  std::vector<std::pair<std::uint32_t, std::uint32_t>> of;  // set and curve
  std::vector<std::string> doubts;
};

// Curves of a set for which the same is done: what is wrong with the first, and how many there are.
struct Faults {
  std::string first;
  std::size_t count = 0;

  void add(std::size_t curve, const std::string& what) {
    if (count++ == 0) first = "curve " + std::to_string(curve) + ' ' + what;
  }
  void tell(const CurveSet& set, const std::string& done, std::vector<std::string>& doubts) const {
    if (count == 0) return;
    doubts.push_back(shown(set.name) + ": " + first + ": " + std::to_string(count) + " of " +
                     counted(set.curve_count(), "curve") + ' ' + done);
  }
};

void sample_set(const CurveSet& set, std::uint32_t number, float coarseness, Sampled& sampled) {
  Faults lost, straight;
  for (std::size_t c = 0; c < set.curve_count(); ++c) {
    const std::span<const Vec3f> controls = set.curve(c);
    const bool is_finite = std::ranges::all_of(controls, [](const Vec3f& x) { return x.allFinite(); });
    if (!is_finite || controls.size() < 2) {
      lost.add(c, is_finite ? "has " + counted(controls.size(), "point") : "has a point that is not finite");
      continue;
    }
    const float tolerance = coarseness * std::max(curve_tolerance(controls), std::numeric_limits<float>::min());
    Result<std::vector<CurvePoint>> points = sample_curve(set.basis, set.wrap, controls, tolerance);
    if (!points) {
      straight.add(c, points.error());
      points = sample_curve(CurveBasis::linear, CurveWrap::open, controls, tolerance);
    }
    for (const CurvePoint& point : *points) sampled.points.push_back(value_at(point, controls));
    sampled.begin.push_back(static_cast<std::uint32_t>(sampled.points.size()));
    sampled.of.emplace_back(number, static_cast<std::uint32_t>(c));
    if (sampled.points.size() > GroomLimits{}.point_count_max) return;
  }
  lost.tell(set, "left out", sampled.doubts);
  straight.tell(set, "read as straight lines between their points", sampled.doubts);
}

// Curves that would have too many points are followed less closely; at last each segment is one piece.
Sampled sample_all(std::span<const CurveSet> sets) {
  constexpr float kCoarser = 4, kCoarsest = 4096;
  for (float coarseness = 1;; coarseness *= kCoarser) {
    Sampled sampled;
    for (std::size_t s = 0; s < sets.size(); ++s) {
      sample_set(sets[s], static_cast<std::uint32_t>(s), coarseness, sampled);
      if (sampled.points.size() > GroomLimits{}.point_count_max) break;
    }
    if (sampled.points.size() <= GroomLimits{}.point_count_max || coarseness >= kCoarsest) return sampled;
  }
}

void set_groups(std::span<const CurveSet> sets, const Sampled& sampled, ImportedStrands& strands) {
  std::map<std::string, std::uint16_t> numbers;
  std::vector<std::string> names;
  for (const auto& [s, c] : sampled.of) {
    const std::string& name = sets[s].groups.empty() ? sets[s].name : sets[s].groups[c];
    const auto [group, is_new] = numbers.try_emplace(name, static_cast<std::uint16_t>(names.size()));
    if (is_new) names.push_back(name);
    if (names.size() > GroomLimits{}.group_count_max) {
      strands.notes.push_back("there are more groups than the " + std::to_string(GroomLimits{}.group_count_max) +
                              " of a groom: they become one");
      strands.groups.clear();
      return;
    }
    strands.groups.push_back(group->second);
  }
  if (names.size() == 1) strands.groups.clear();
  if (names.size() > 1) strands.group_names = std::move(names);
}

}  // namespace

void make_strands(std::span<const CurveSet> sets, ImportedStrands& strands) {
  Sampled sampled = sample_all(sets);
  strands.points = std::move(sampled.points);
  strands.strand_begin = std::move(sampled.begin);
  std::ranges::move(sampled.doubts, std::back_inserter(strands.doubts));
  set_groups(sets, sampled, strands);
  const bool has_widths = std::ranges::any_of(sets, [](const CurveSet& set) { return !set.widths.empty(); });
  const bool has_colours = std::ranges::any_of(sets, [](const CurveSet& set) { return !set.colours.empty(); });
  for (const auto& [s, c] : sampled.of) {
    if (has_widths) strands.widths.push_back(sets[s].widths.empty() ? 0 : sets[s].widths[c]);
    if (has_colours) strands.colours.push_back(sets[s].colours.empty() ? Vec3f::Zero() : sets[s].colours[c]);
  }
  std::size_t curve_count = 0, control_count = 0;
  for (const CurveSet& set : sets) {
    curve_count += set.curve_count();
    control_count += set.controls.size();
  }
  strands.notes.push_back(counted(curve_count, "curve") + " of " + counted(control_count, "control point") +
                          ", read as " + counted(strands.strand_count(), "strand") + " of " +
                          counted(strands.points.size(), "point"));
}

}  // namespace hairnet
