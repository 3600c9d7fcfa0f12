#pragma once

#include <string>
#include <vector>

#include "client/assets/import/alembic_archive.hpp"
#include "client/assets/import/curve_bases.hpp"

namespace hairnet {

// The extent over which one value of an attribute holds. A segment's end is what Alembic calls "varying".
enum class AbcScope : std::uint8_t { object, curve, point, segment_end };

// An attribute of curves: its values, and for indexed attributes the index of the value at each place. Numbers and
// texts view the file's bytes.
struct AbcAttribute {
  std::string_view name;
  AbcNumbers numbers, indices;
  std::vector<std::string_view> texts;
  AbcScope scope = AbcScope::object;

  // Component `c` of the value at a place of its scope, where values have `components`.
  [[nodiscard]] double value(std::size_t at, std::size_t c = 0, std::size_t components = 1) const;
  [[nodiscard]] std::string_view text(std::size_t at) const;
};

// One sample of a Curves object, its structure checked; a curve of it may still be bad. Positions of other samples can
// take the place of its own, as long as the structure does not change.
struct AbcCurves {
  struct Curve {
    // Its control points.
    std::size_t first = 0, count = 0;
    // They matter only where it has knots.
    std::size_t first_knot = 0, order = 4;
    // Its segments' ends, in attributes given there.
    std::size_t first_end = 0, end_count = 0;
  };
  AbcNumbers positions, weights;
  std::vector<Curve> curves;
  // The number of curves behind these that the file lists without having their control points.
  std::size_t missing_curves = 0;
  CurveBasis basis = CurveBasis::linear;
  CurveWrap wrap = CurveWrap::open;
  // An empty list means even knots.
  std::vector<float> knots;
  std::vector<AbcAttribute> attributes;
  // These are names of attributes.
  std::vector<std::string_view> unused, unknown;
  // Each line tells what is odd in the object, and becomes a doubt.
  std::vector<std::string> remarks;
  // Why none of its curves can be read; empty: they can be.
  std::string error;

  [[nodiscard]] std::size_t point_count() const { return positions.size() / 3; }
};

// The properties of a Curves object: those of its `.geom`, and those of the compounds in it.
struct AbcCurvesProperties {
  std::vector<AbcProperty> geometry, arbitrary, user;
  static Result<AbcCurvesProperties> read(AbcArchive& archive, const std::vector<AbcProperty>& of_object);
};

// The curves as they are in their first sample. An error is one of the file; why these curves alone cannot be read is
// in AbcCurves::error.
Result<AbcCurves> read_curves(AbcArchive& archive, const AbcCurvesProperties& properties);

// Appends the attributes among `properties` that an import uses, once each, for curves of these counts, to `into`. The
// names of the others go to `unused` if it is known what they are or if their count fits nothing, else to `unknown`.
struct AbcCounts {
  std::size_t curves = 0, points = 0, segment_ends = 0;
};
Result<void> read_attributes(AbcArchive& archive, const std::vector<AbcProperty>& properties, const AbcCounts& counts,
                             AbcCurves& into);

// The properties of a compound property among others; none, if it is not there.
Result<std::vector<AbcProperty>> properties_in(AbcArchive& archive, const std::vector<AbcProperty>& among,
                                               std::string_view name);

// The control points of a curve out of positions, in the world. `controls` is resized to the curve's count and keeps
// its memory between calls. The curve must lie within `positions`.
void read_controls(const AbcNumbers& positions, const AbcCurves::Curve& curve, const Eigen::Affine3d& world,
                   std::vector<Vec3f>& controls);

// Points on curve `c`, or why it is bad: no points, one that is not finite, or too few for its kind. `controls` are its
// control points. Weights of rational curves are already in the points' weights.
Result<std::vector<CurvePoint>> sample_abc_curve(const AbcCurves& curves, std::size_t c,
                                                 std::span<const Vec3f> controls);

}  // namespace hairnet
