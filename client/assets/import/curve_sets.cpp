#include "client/assets/import/curve_sets.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "client/assets/import/parse_text.hpp"
#include "core/groom/groom.hpp"
#include "core/shown_text.hpp"

namespace hairnet {
namespace {

// Longer names of groups are cut to this many bytes.
constexpr std::size_t kGroupNameBytes = 64;

// The points of all curves that become strands, one after the other.
struct Sampled {
  std::vector<Vec3f> points, colours;
  std::vector<float> widths;
  bool has_widths = false, has_colours = false;
  std::vector<std::uint32_t> begin{0};
  // The set and the curve that each strand comes from.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> of;
  std::vector<std::string> doubts;
};

// The curves of a set that are left out, or read in another way: their number, and a description of the first one.
struct Defects {
  std::string first;
  std::size_t count = 0;

  void add(std::size_t curve, const std::string& what) {
    if (count++ == 0) first = "curve " + std::to_string(curve) + ' ' + what;
  }
  void tell(const CurveSet& set, const std::string& done, std::vector<std::string>& doubts) const {
    if (count == 0) return;
    doubts.push_back((set.name.empty() ? "" : shown(set.name) + ": ") + first + ": " + std::to_string(count) + " of " +
                     counted(set.curve_count(), "curve") + ' ' + done);
  }
};

// How closely curves are followed. A coarseness of 1 is as close as can be seen; each larger one is a factor on the
// tolerance.
struct Detail {
  float coarseness = 1;
  // Curves that are straight lines between their points use one of this many points.
  std::size_t point_step = 1;
  // One of this many curves is taken.
  std::size_t curve_step = 1;
};

// Widths and colours use the same weighted sums as positions, so that they fit the points of any basis.
void add_points(const CurveSet& set, std::size_t curve, std::span<const CurvePoint> points, std::size_t step,
                Sampled& sampled) {
  const std::size_t begin = set.begin[curve], count = set.begin[curve + 1] - begin;
  const auto add = [&](const auto& of_controls, auto& values) {
    const std::span controls(of_controls.data() + begin, count);
    // The last point is kept at any step, because a strand that loses its tip changes its length.
    for (std::size_t i = 0; i + 1 < points.size(); i += step) values.push_back(value_at(points[i], controls));
    values.push_back(value_at(points.back(), controls));
  };
  add(set.controls, sampled.points);
  if (!set.widths.empty()) add(set.widths, sampled.widths);
  if (!set.colours.empty()) add(set.colours, sampled.colours);
  // Sets without widths get zeros when another set has some, so that the lists fit the points.
  if (sampled.has_widths) sampled.widths.resize(sampled.points.size(), 0);
  if (sampled.has_colours) sampled.colours.resize(sampled.points.size(), Vec3f::Zero());
}

// `first`: the first curve of the set that is taken; each curve_step-th one follows.
void sample_set(const CurveSet& set, std::uint32_t number, std::size_t first, const Detail& detail, Sampled& sampled) {
  Defects lost, straight;
  for (std::size_t c = first; c < set.curve_count(); c += detail.curve_step) {
    const std::span<const Vec3f> controls = set.curve(c);
    // Finite points are checked before any arithmetic: one NaN would reach the placement of the whole head.
    const bool is_finite = std::ranges::all_of(controls, [](const Vec3f& x) { return x.allFinite(); });
    if (!is_finite || controls.size() < 2) {
      lost.add(c, is_finite ? "has " + counted(controls.size(), "point") : "has a point that is not finite");
      continue;
    }
    // The smallest positive number keeps a curve of no length from dividing by zero.
    const float tolerance = detail.coarseness * std::max(curve_tolerance(controls), std::numeric_limits<float>::min());
    Result<std::vector<CurvePoint>> points = sample_curve(set.basis, set.wrap, controls, tolerance);
    // A curve whose number of control points its basis does not allow still shows where the hair is, so it becomes a
    // polyline.
    const bool is_straight = !points || set.basis == CurveBasis::linear;
    if (!points) {
      straight.add(c, points.error());
      points = sample_curve(CurveBasis::linear, CurveWrap::open, controls, tolerance);
    }
    add_points(set, c, *points, is_straight ? detail.point_step : 1, sampled);
    sampled.begin.push_back(static_cast<std::uint32_t>(sampled.points.size()));
    sampled.of.emplace_back(number, static_cast<std::uint32_t>(c));
    // Too many points already mean a new round with less detail, so sampling the rest is in vain.
    if (sampled.points.size() > GroomLimits{}.point_count_max) return;
  }
  lost.tell(set, "left out", sampled.doubts);
  straight.tell(set, "read as straight lines between their points", sampled.doubts);
}

Sampled sample_all(std::span<const CurveSet> sets, std::size_t curve_count) {
  // At this coarseness each segment of a curve is one piece: the pieces go with the inverse square root of the
  // tolerance, and at a coarseness of 1 a segment has at most 64 (kPiecesMax of curve_bases.cpp), the root of 4096.
  constexpr float kCoarsest = 4096;
  Detail detail;
  // Curves are thinned evenly over the list, since the first ones alone may all grow on one side of a head.
  detail.curve_step = (curve_count + GroomLimits{}.strand_count_max - 1) / GroomLimits{}.strand_count_max;
  // Each round is four times as coarse and takes half of the points of polylines, until a groom can hold the rest. At
  // the coarsest, curves cannot get fewer points; the caller refuses.
  for (;; detail.coarseness *= 4, detail.point_step *= 2) {
    Sampled sampled;
    sampled.has_widths = std::ranges::any_of(sets, [](const CurveSet& set) { return !set.widths.empty(); });
    sampled.has_colours = std::ranges::any_of(sets, [](const CurveSet& set) { return !set.colours.empty(); });
    // The steps go on from set to set. Otherwise each set would keep its first curve, and many sets of few curves would
    // keep more than their share.
    std::size_t first = 0;
    for (std::size_t s = 0; s < sets.size(); ++s) {
      sample_set(sets[s], static_cast<std::uint32_t>(s), first, detail, sampled);
      // The step that begins in this set may end in a later one: `first` is how many curves of the next set it passes
      // over.
      const std::size_t count = sets[s].curve_count(), step = detail.curve_step;
      first = first >= count ? first - count : (step - (count - first) % step) % step;
      if (sampled.points.size() > GroomLimits{}.point_count_max) break;
    }
    if (sampled.points.size() > GroomLimits{}.point_count_max && detail.coarseness < kCoarsest) continue;
    if (detail.curve_step > 1)
      sampled.doubts.push_back("there are more curves than the " + std::to_string(GroomLimits{}.strand_count_max) +
                               " strands of a groom: one of " + std::to_string(detail.curve_step) + " is taken");
    if (detail.point_step > 1)
      sampled.doubts.push_back("there are more points than the " + std::to_string(GroomLimits{}.point_count_max) +
                               " of a groom: strands have fewer, up to " + std::to_string(detail.point_step) +
                               " times");
    return sampled;
  }
}

// A name that several sets share makes one group. Beyond a groom's limit all strands become one group, since any choice
// of names would be arbitrary.
void set_groups(std::span<const CurveSet> sets, const Sampled& sampled, ImportedStrands& strands) {
  std::map<std::string, std::uint32_t> numbers;
  std::vector<std::string> names;
  for (const auto& [s, c] : sampled.of) {
    const std::string& name = sets[s].groups.empty() ? sets[s].name : sets[s].groups[c];
    const auto [group, is_new] = numbers.try_emplace(name, static_cast<std::uint32_t>(names.size()));
    if (is_new) names.push_back(name);
    if (names.size() > GroomLimits{}.group_count_max) {
      strands.doubts.push_back("there are more groups than the " + std::to_string(GroomLimits{}.group_count_max) +
                               " of a groom: they become one");
      strands.groups.clear();
      return;
    }
    strands.groups.push_back(group->second);
  }
  // A single object makes no group, unless the file names one.
  const bool is_said = std::ranges::any_of(sets, [](const CurveSet& set) { return !set.groups.empty(); });
  if (names.size() > 1 || is_said) strands.group_names = std::move(names);
  if (strands.group_names.empty()) strands.groups.clear();
}

}  // namespace

std::string shown_group(std::string_view name) {
  return shown_text(name, kGroupNameBytes, '"');
}

// The range check keeps the cast to int defined, also for NaN.
std::string numbered_group(double number) {
  return "group " + std::to_string(std::abs(number) < 1e9 ? static_cast<int>(number) : -1);
}

std::string make_strands(std::span<const CurveSet> sets, ImportedStrands& strands) {
  std::size_t curve_count = 0, control_count = 0;
  for (const CurveSet& set : sets) {
    curve_count += set.curve_count();
    control_count += set.controls.size();
  }
  if (curve_count == 0) return "no curves";
  Sampled sampled = sample_all(sets, curve_count);
  if (sampled.points.size() > GroomLimits{}.point_count_max)
    return "the curves have " + std::to_string(control_count) + " points, and a groom holds " +
           std::to_string(GroomLimits{}.point_count_max) + ": export fewer curves";
  if (sampled.of.empty()) return "no curve can be read: " + sampled.doubts.front();
  strands.points = std::move(sampled.points);
  strands.strand_begin = std::move(sampled.begin);
  std::ranges::move(sampled.doubts, std::back_inserter(strands.doubts));
  set_groups(sets, sampled, strands);
  strands.widths = std::move(sampled.widths);
  strands.colours = std::move(sampled.colours);
  strands.notes.push_back(counted(curve_count, "curve") + " of " + counted(control_count, "control point") +
                          ", read as " + counted(strands.strand_count(), "strand") + " of " +
                          counted(strands.points.size(), "point"));
  return {};
}

Result<ImportedStrands> strands_of(std::span<const CurveSet> sets) {
  ImportedStrands strands;
  if (std::string error = make_strands(sets, strands); !error.empty()) return Refusal(std::move(error));
  return strands;
}

}  // namespace hairnet
