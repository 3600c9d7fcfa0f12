#include "client/assets/import/alembic_strands.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "client/assets/import/curve_sets.hpp"
#include "client/assets/import/parse_text.hpp"

namespace hairnet {
namespace {

constexpr std::size_t kExamplesMax = 3;
// The most groups of a groom (GroomLimits::group_count_max).
constexpr std::size_t kGroupsMax = 256;

const AbcAttribute* find_attribute(const std::vector<AbcAttribute>& attributes, std::string_view name) {
  const auto found = std::ranges::find(attributes, name, &AbcAttribute::name);
  return found == attributes.end() ? nullptr : &*found;
}

// The first of these names that the object or one above it has. A name's own object counts before those above, and an
// earlier name before a later one.
const AbcAttribute* find_attribute(const AbcCurves& curves, const AbcPlace& place,
                                   std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    if (const AbcAttribute* own = find_attribute(curves.attributes, name)) return own;
    if (const AbcAttribute* above = find_attribute(place.above, name)) return above;
  }
  return nullptr;
}

// Where the first value of a curve stands.
std::size_t first_of(const AbcAttribute& attribute, const AbcCurves::Curve& curve, std::size_t c) {
  return std::array{std::size_t{0}, c, curve.first, curve.first_end}[static_cast<std::size_t>(attribute.scope)];
}

// The value of an attribute at a point on a curve. Values at control points are mixed with the point's own weights, and
// those at segments' ends linearly along the segment.
double value_at_point(const AbcAttribute& attribute, const AbcCurves& curves, std::size_t c, const CurvePoint& point,
                      std::size_t component, std::size_t components) {
  const AbcCurves::Curve& curve = curves.curves[c];
  const std::size_t first = first_of(attribute, curve, c);
  const auto value = [&](std::size_t i) { return attribute.value(first + i, component, components); };
  if (attribute.scope == AbcScope::point) {
    double sum = 0;
    for (std::size_t i = 0; i < 4; ++i) sum += double{point.weight[i]} * value(point.control[i]);
    return sum;
  }
  if (attribute.scope != AbcScope::segment_end || curve.end_count == 0) return value(0);
  // A closed curve has as many ends as segments, and the last segment ends in the first one.
  const auto end = [&](std::size_t i) {
    return value(curves.wrap == CurveWrap::periodic ? i % curve.end_count : std::min(i, curve.end_count - 1));
  };
  const auto before = static_cast<std::size_t>(point.segment);
  const double share = double{point.segment} - static_cast<double>(before);
  return (1 - share) * end(before) + share * end(before + 1);
}

// Attributes may hold anything; a number that is not finite becomes 0 instead of a reason to lose the strand.
float finite(double value) {
  const auto single = static_cast<float>(value);
  return std::isfinite(single) ? single : 0;
}

}  // namespace

void AbcExamples::add(const std::string& example, std::size_t count) {
  if (examples_.size() < kExamplesMax) examples_.push_back(example);
  count_ += count;
}

std::string AbcExamples::text() const {
  std::string text;
  for (const std::string& example : examples_) text += (text.empty() ? "" : ", ") + example;
  return count_ > examples_.size() ? text + ", ..." : text;
}

std::vector<std::vector<CurvePoint>> AbcStrands::add(const AbcCurves& curves, const AbcPlace& place) {
  std::vector<std::vector<CurvePoint>> points(curves.curves.size());
  std::vector<Vec3f> controls;
  for (std::size_t c = 0; c < curves.curves.size(); ++c) {
    const AbcCurves::Curve& curve = curves.curves[c];
    read_controls(curves.positions, curve, place.world, controls);
    auto sampled = sample_abc_curve(curves, c, controls);
    if (!sampled) {
      // A bad curve keeps its empty place in the result, so that `points[c]` always belongs to curve c.
      bad_.add("curve " + std::to_string(c) + " of " + place.path + " " + sampled.error());
      continue;
    }
    points[c] = std::move(*sampled);
    for (const CurvePoint& point : points[c])
      strands_.points.push_back(value_at(point, std::span<const Vec3f>(controls)));
    strands_.strand_begin.push_back(static_cast<std::uint32_t>(strands_.points.size()));
    control_count_ += curve.count;
    add_attributes(curves, place, c, points[c]);
  }
  if (curves.missing_curves > 0) {
    const std::string first = std::to_string(curves.curves.size());
    bad_.add("from curve " + first + " on, the curves of " + place.path + " have more points than the file",
             curves.missing_curves);
  }
  const std::size_t listed = curves.curves.size() + curves.missing_curves;
  listed_count_ += listed;
  has_object_of_many_ = has_object_of_many_ || listed > 1;
  return points;
}

void AbcStrands::add_attributes(const AbcCurves& curves, const AbcPlace& place, std::size_t c,
                                const std::vector<CurvePoint>& points) {
  const AbcCurves::Curve& curve = curves.curves[c];
  const auto attribute = [&](std::initializer_list<std::string_view> names) {
    return find_attribute(curves, place, names);
  };
  // Lists begin with the first curve that has such a value; those before it have none.
  const std::size_t strand = strands_.strand_count() - 1, first_point = strands_.strand_begin[strand];
  // Epic's width stands before that of the curves, which an export to it leaves as it is.
  if (const AbcAttribute* width = attribute({"groom_width", "width"})) {
    // Widths are lengths and scale with the transform. The cube root of the determinant is the mean scale of all
    // directions.
    const double scale = std::cbrt(std::abs(place.world.linear().determinant()));
    strands_.widths.resize(first_point);
    for (const CurvePoint& point : points)
      strands_.widths.push_back(std::max(finite(scale * value_at_point(*width, curves, c, point, 0, 1)), 0.f));
  }
  if (const AbcAttribute* colour = attribute({"groom_color"})) {
    strands_.colours.resize(first_point, Vec3f::Zero());
    for (const CurvePoint& point : points) {
      const auto component = [&](std::size_t i) { return finite(value_at_point(*colour, curves, c, point, i, 3)); };
      strands_.colours.emplace_back(component(0), component(1), component(2));
    }
  }
  if (const AbcAttribute* uv = attribute({"groom_root_uv", "uv"})) {
    const std::size_t first = first_of(*uv, curve, c);
    strands_.root_uvs.resize(strand, Eigen::Vector2f::Zero());
    strands_.root_uvs.emplace_back(finite(uv->value(first, 0, 2)), finite(uv->value(first, 1, 2)));
  }
  const AbcAttribute* guide = attribute({"groom_guide"});
  if (guide != nullptr && guide->value(first_of(*guide, curve, c)) != 0) {
    strands_.guides.resize(strand);
    strands_.guides.push_back(1);
  }

  const AbcAttribute *name = attribute({"groom_group_name"}), *id = attribute({"groom_group_id"});
  const std::string_view said = name == nullptr ? std::string_view() : name->text(first_of(*name, curve, c));
  are_groups_said_ = are_groups_said_ || !said.empty() || id != nullptr;
  if (!said.empty()) {
    strands_.groups.push_back(group_index(shown_group(said)));
  } else if (id != nullptr) {
    strands_.groups.push_back(group_index(numbered_group(id->value(first_of(*id, curve, c)))));
  } else {
    strands_.groups.push_back(group_index(shown_group(place.name)));
  }
}

std::uint32_t AbcStrands::group_index(std::string name) {
  const auto [found, is_new] = groups_.try_emplace(std::move(name), static_cast<std::uint32_t>(groups_.size()));
  if (is_new) strands_.group_names.push_back(found->first);
  return found->second;
}

// Where no attribute names groups, each object is a group. Not so where no object has several curves: Maya writes each
// curve as an object of its own, and a group for each curve would be useless.
void AbcStrands::settle_groups() {
  const std::size_t count = strands_.group_names.size();
  const bool are_objects_groups = count > 1 && count <= kGroupsMax && has_object_of_many_;
  if (are_groups_said_ ? count <= kGroupsMax : are_objects_groups) return;
  if (are_groups_said_)
    strands_.doubts.push_back(counted(count, "group") + " are more than a groom may have, and become one");
  strands_.groups.clear();
  strands_.group_names.clear();
}

ImportedStrands AbcStrands::take() {
  // Lists end with the last strand that has a value; the strands behind it get none.
  if (!strands_.widths.empty()) strands_.widths.resize(point_count());
  if (!strands_.colours.empty()) strands_.colours.resize(point_count(), Vec3f::Zero());
  if (!strands_.root_uvs.empty()) strands_.root_uvs.resize(strand_count(), Eigen::Vector2f::Zero());
  if (!strands_.guides.empty()) strands_.guides.resize(strand_count());
  settle_groups();
  return std::move(strands_);
}

}  // namespace hairnet
