#include "client/assets/import/alembic_curves.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hairnet {
namespace {

// The numbers are those of the format.
enum CurveType : unsigned { kCubic, kLinear, kVariableOrder };
// Their product, 1e33, is far below the largest float, 3e38, so weighted sums of control points stay finite.
constexpr float kCoordinateMax = 1e30f, kWeightMax = 1e3f;
// These belong to the schema, so a note must not list them as unknown attributes.
constexpr std::array<std::string_view, 10> kStructure{
    "P", "nVertices", "curveBasisAndType", ".knots",         ".orders",
    "w", ".selfBnds", ".childBnds",        ".arbGeomParams", ".userProperties"};
// These attributes become a part of the strands. `is_known` adds those that a groom has no place for, so that a note
// need not call them unknown.
constexpr std::array<std::string_view, 8> kUsed{"width",       "uv",          "groom_width",    "groom_root_uv",
                                                "groom_color", "groom_guide", "groom_group_id", "groom_group_name"};

bool contains(std::span<const std::string_view> names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

bool is_known(std::string_view name) {
  return name == "N" || name == ".velocities" || name.starts_with("groom_") || contains(kUsed, name);
}

// Attributes whose values have components, also where the file stores these one by one.
std::size_t components_of(std::string_view name, std::size_t extent) {
  if (name == "uv" || name == "groom_root_uv") return 2;
  return name == "groom_color" ? 3 : std::max(extent, std::size_t{1});
}

// How many values an attribute of this scope has.
std::size_t size_of(AbcScope scope, const AbcCounts& counts) {
  constexpr std::size_t kOne = 1;
  return std::array{kOne, counts.curves, counts.points, counts.segment_ends}[static_cast<std::size_t>(scope)];
}

// Finds the scope by what the file says if its count agrees, else by its count, because exporters state wrong scopes. A
// count that fits several scopes is taken for the first of points, curves, segments' ends and the object.
bool find_scope(std::string_view said, std::size_t count, const AbcCounts& counts, AbcScope& scope) {
  constexpr std::array<std::pair<std::string_view, AbcScope>, 5> kSaid{{{"con", AbcScope::object},
                                                                        {"uni", AbcScope::curve},
                                                                        {"vtx", AbcScope::point},
                                                                        {"fvr", AbcScope::point},
                                                                        {"var", AbcScope::segment_end}}};
  for (const auto& [name, as_said] : kSaid) {
    scope = as_said;
    if (said == name && count == size_of(scope, counts)) return true;
  }
  for (const AbcScope fits : {AbcScope::point, AbcScope::curve, AbcScope::segment_end, AbcScope::object}) {
    scope = fits;
    if (count == size_of(scope, counts)) return true;
  }
  return false;
}

// How many ends of segments a curve has, as cubic curves count them.
std::size_t segment_ends(CurveBasis basis, CurveWrap wrap, std::size_t points, std::size_t order) {
  if (basis == CurveBasis::linear) return points;
  const std::size_t is_open = wrap == CurveWrap::periodic ? 0 : 1;
  if (basis == CurveBasis::bezier) return (points - (points > 0 ? is_open : 0)) / 3 + is_open;
  if (wrap == CurveWrap::periodic) return points;
  return points < order ? 0 : points - order + 2;
}

// Knots that let a curve without any begin and end in its outer control points. These are the clamped even knots, such
// as 0 0 0 0 1 2 3 3 3 3.
void add_usual_knots(std::size_t points, std::size_t order, std::vector<float>& knots) {
  if (points < order || order == 0) return;
  const std::size_t inner = points - order + 1;
  for (std::size_t i = 0; i < points + order; ++i)
    knots.push_back(static_cast<float>(std::min(i < order ? 0 : i - order + 1, inner)));
}

// The property has four bytes, of which three matter: the type of the curves, whether they are closed, and the basis.
std::string read_basis(const AbcProperty* property, bool& is_variable, AbcCurves& curves) {
  const AbcNumbers said = property == nullptr ? AbcNumbers() : property->numbers(0);
  if (said.size() < 3) {
    curves.remarks.emplace_back("does not say how its points make curves, and is taken as linear");
    return {};
  }
  // The numbers of a basis are 0 none, 1 Bezier, 2 B-spline, 3 Catmull-Rom, 4 Hermite and 5 power.
  const unsigned type = said.small(0), basis = said.small(2);
  if (said[1] == 1) curves.wrap = CurveWrap::periodic;
  is_variable = type == kVariableOrder;
  if (type == kLinear) return {};
  if (type != kCubic && type != kVariableOrder)
    return "has curves of type " + std::to_string(type) + ", which there are not";
  // Curves of variable order are B-splines; their basis byte says nothing.
  curves.basis = CurveBasis::bspline;
  if (is_variable || basis == 2) return {};
  // Pinned ends make a curve without a basis begin and end in its outer control points, so that its root stays on the
  // skin.
  if (basis == 0) {
    curves.remarks.emplace_back("is cubic without a basis, and is taken as B-splines");
    if (curves.wrap == CurveWrap::open) curves.wrap = CurveWrap::pinned;
  } else if (basis == 1 || basis == 3) {
    curves.basis = basis == 1 ? CurveBasis::bezier : CurveBasis::catmull_rom;
  } else {
    return std::string("has ") + (basis == 4 ? "Hermite curves" : "curves with a power basis") +
           ", which are not read: export linear, Bezier or B-spline curves";
  }
  return {};
}

// Divides the control points among the curves. Curves behind the end of the points are counted as missing.
void divide_points(const AbcNumbers& counts, const AbcNumbers& orders, AbcCurves& curves) {
  std::size_t first = 0, first_end = 0;
  for (std::size_t c = 0; c < counts.size(); ++c) {
    const double count = counts[c];
    // The negated comparison also catches NaN.
    if (!(count >= 0 && count <= static_cast<double>(curves.point_count() - first))) {
      // A wrong count shifts the points of all later curves, so none of those can be trusted.
      curves.missing_curves = counts.size() - c;
      break;
    }
    // The order is 4, as of a cubic curve, unless the file gives an order for each curve.
    AbcCurves::Curve curve{first, static_cast<std::size_t>(count), 0, 4, first_end, 0};
    if (c < orders.size()) curve.order = orders.small(c);
    curve.end_count = segment_ends(curves.basis, curves.wrap, curve.count, curve.order);
    first += curve.count;
    first_end += curve.end_count;
    curves.curves.push_back(curve);
  }
  if (curves.missing_curves == 0 && first < curves.point_count())
    curves.remarks.push_back("has " + std::to_string(curves.point_count() - first) + " points behind its last curve");
}

// Only B-splines have knots. If the file has all knots, they are used; otherwise the knots are even.
void read_knots(const AbcProperty* property, bool is_variable, AbcCurves& curves) {
  if (curves.basis != CurveBasis::bspline) return;
  const AbcNumbers knots = property == nullptr ? AbcNumbers() : property->numbers(0);
  std::size_t count = 0;
  for (AbcCurves::Curve& curve : curves.curves) {
    curve.first_knot = count;
    count += curve.count + curve.order;
  }
  if (knots.size() == count && curves.missing_curves == 0) {
    for (std::size_t i = 0; i < count; ++i) curves.knots.push_back(knots.single(i));
    return;
  }
  if (knots.size() > 0) curves.remarks.emplace_back("has knots that do not fit its curves, and are not used");
  // Curves of one order without knots are even B-splines, which `sample_curve` makes. Those of variable order need
  // knots in any case, since each order has its own.
  if (!is_variable) return;
  for (AbcCurves::Curve& curve : curves.curves) {
    curve.first_knot = curves.knots.size();
    add_usual_knots(curve.count, curve.order, curves.knots);
  }
}

}  // namespace

Result<std::vector<AbcProperty>> properties_in(AbcArchive& archive, const std::vector<AbcProperty>& among,
                                               std::string_view name) {
  const AbcProperty* property = find(among, name);
  if (property == nullptr || property->kind != AbcProperty::Kind::compound) return std::vector<AbcProperty>();
  return archive.properties(property->group);
}

// An index or a component beyond the values gives 0 instead of an error: an attribute is never worth the loss of a
// curve.
double AbcAttribute::value(std::size_t at, std::size_t c, std::size_t components) const {
  if (indices.size() > 0) {
    const double index = at < indices.size() ? indices[at] : -1;
    if (!(index >= 0 && index < static_cast<double>(numbers.size()))) return 0;
    at = static_cast<std::size_t>(index);
  }
  const std::size_t i = components * at + c;
  return i < numbers.size() ? numbers[i] : 0;
}

std::string_view AbcAttribute::text(std::size_t at) const {
  if (indices.size() > 0) {
    const double index = at < indices.size() ? indices[at] : -1;
    if (!(index >= 0 && index < static_cast<double>(texts.size()))) return {};
    at = static_cast<std::size_t>(index);
  }
  return at < texts.size() ? texts[at] : std::string_view();
}

namespace {

// Reads an attribute. Its name is empty if it has no values, or a number of values that fits no scope.
Result<AbcAttribute> read_attribute(AbcArchive& archive, const AbcProperty& property, const AbcCounts& counts) {
  AbcAttribute attribute;
  const AbcProperty* values = &property;
  std::vector<AbcProperty> parts;
  if (property.kind == AbcProperty::Kind::compound) {
    auto read = archive.properties(property.group);
    if (!read) return Refusal(read.error());
    parts = std::move(*read);
    values = find(parts, ".vals");
    if (const AbcProperty* indices = find(parts, ".indices")) attribute.indices = indices->numbers(0);
  }
  if (values == nullptr) return attribute;
  auto texts = archive.texts(*values, 0);
  if (!texts) return Refusal(texts.error());
  attribute.texts = std::move(*texts);
  attribute.numbers = values->numbers(0);
  std::size_t count = attribute.indices.size();
  if (count == 0)
    count = values->is_text() ? attribute.texts.size()
                              : attribute.numbers.size() / components_of(property.name, values->extent);
  if (count > 0 && find_scope(metadata_value(property.metadata, "geoScope"), count, counts, attribute.scope))
    attribute.name = property.name;
  return attribute;
}

}  // namespace

Result<void> read_attributes(AbcArchive& archive, const std::vector<AbcProperty>& properties, const AbcCounts& counts,
                             AbcCurves& into) {
  for (const AbcProperty& property : properties) {
    if (contains(kStructure, property.name)) continue;
    if (!contains(kUsed, property.name)) {
      (is_known(property.name) ? into.unused : into.unknown).push_back(property.name);
      continue;
    }
    // An attribute may stand in several compounds. The first one read counts: the geometry's own, then the arbitrary
    // ones, then the user's.
    if (std::ranges::find(into.attributes, property.name, &AbcAttribute::name) != into.attributes.end()) continue;
    auto attribute = read_attribute(archive, property, counts);
    if (!attribute) return Refusal(attribute.error());
    if (attribute->name.empty()) {
      into.unused.push_back(property.name);
    } else {
      into.attributes.push_back(std::move(*attribute));
    }
  }
  return {};
}

Result<AbcCurvesProperties> AbcCurvesProperties::read(AbcArchive& archive, const std::vector<AbcProperty>& of_object) {
  AbcCurvesProperties out;
  const std::array<std::pair<std::string_view, std::vector<AbcProperty>*>, 3> parts{
      {{".geom", &out.geometry}, {".arbGeomParams", &out.arbitrary}, {".userProperties", &out.user}}};
  for (const auto& [name, into] : parts) {
    auto part = properties_in(archive, name == ".geom" ? of_object : out.geometry, name);
    if (!part) return Refusal(part.error());
    *into = std::move(*part);
  }
  return out;
}

Result<AbcCurves> read_curves(AbcArchive& archive, const AbcCurvesProperties& properties) {
  const std::vector<AbcProperty>& geometry = properties.geometry;
  const AbcProperty *positions = find(geometry, "P"), *counts = find(geometry, "nVertices");
  AbcCurves curves;
  if (positions == nullptr || counts == nullptr) {
    curves.error = std::string("has no ") + (positions == nullptr ? "P" : "nVertices");
    return curves;
  }
  curves.positions = positions->numbers(0);
  if (curves.positions.size() % 3 != 0) curves.error = "has a P that is no list of points";
  // Each value can become 8 bytes in memory. The spending stops an archive in which thousands of objects share one
  // large array.
  const AbcProperty* knots = find(geometry, ".knots");
  std::uint64_t values = 0;
  for (const AbcProperty* property : {positions, counts, knots})
    values += property == nullptr ? 0 : property->numbers(0).size();
  if (!archive.spend(8 * values)) return AbcArchive::overspent();
  bool is_variable = false;
  if (curves.error.empty()) curves.error = read_basis(find(geometry, "curveBasisAndType"), is_variable, curves);
  if (!curves.error.empty()) return curves;
  const AbcProperty* orders = is_variable ? find(geometry, ".orders") : nullptr;
  divide_points(counts->numbers(0), orders == nullptr ? AbcNumbers() : orders->numbers(0), curves);
  read_knots(knots, is_variable, curves);
  if (const AbcProperty* weights = find(geometry, "w"); weights != nullptr) curves.weights = weights->numbers(0);
  // Weights that do not fit the points are ignored, which makes the curve a plain B-spline.
  if (curves.weights.size() != curves.point_count()) curves.weights = {};

  AbcCounts sizes{counts->numbers(0).size(), curves.point_count(), 0};
  for (const AbcCurves::Curve& curve : curves.curves) sizes.segment_ends += curve.end_count;
  for (const std::vector<AbcProperty>* list : {&geometry, &properties.arbitrary, &properties.user}) {
    if (const auto read = read_attributes(archive, *list, sizes, curves); !read) return Refusal(read.error());
  }
  return curves;
}

void read_controls(const AbcNumbers& positions, const AbcCurves::Curve& curve, const Eigen::Affine3d& world,
                   std::vector<Vec3f>& controls) {
  controls.resize(curve.count);
  for (std::size_t i = 0; i < curve.count; ++i) {
    const std::size_t at = 3 * (curve.first + i);
    controls[i] = (world * Vec3(positions[at], positions[at + 1], positions[at + 2])).cast<float>();
  }
}

Result<std::vector<CurvePoint>> sample_abc_curve(const AbcCurves& curves, std::size_t c,
                                                 std::span<const Vec3f> controls) {
  const AbcCurves::Curve& curve = curves.curves[c];
  if (controls.empty()) return Refusal("has no points");
  const auto is_usable = [](const Vec3f& x) { return x.allFinite() && x.cwiseAbs().maxCoeff() <= kCoordinateMax; };
  if (!std::ranges::all_of(controls, is_usable))
    return Refusal("has a coordinate that is not finite, or is beyond 1e30");
  const float tolerance = curve_tolerance(controls);
  const std::span<const float> knots = std::span(curves.knots).subspan(curves.knots.empty() ? 0 : curve.first_knot);
  auto points = curves.knots.empty()
                    ? sample_curve(curves.basis, curves.wrap, controls, tolerance)
                    : sample_knots(curve.order, knots.first(std::min(knots.size(), curve.count + curve.order)),
                                   controls, tolerance);
  if (!points || curves.weights.size() == 0 || curves.basis == CurveBasis::linear) return points;
  // A rational curve is the sum of w_i b_i p_i over the sum of w_i b_i. Folding the weights in here lets all later code
  // see only weighted sums of control points.
  for (CurvePoint& point : *points) {
    float sum = 0;
    for (std::size_t i = 0; i < 4; ++i) sum += point.weight[i] *= curves.weights.single(curve.first + point.control[i]);
    for (float& weight : point.weight) {
      weight /= sum;
      // A sum of 0 gives an infinite or undefined weight, which this comparison catches too.
      if (!(std::abs(weight) <= kWeightMax)) return Refusal("has weights that make no curve");
    }
  }
  return points;
}

}  // namespace hairnet
