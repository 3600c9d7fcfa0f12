#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet {

// How control points make a curve. All but `linear` are cubic.
enum class CurveBasis : std::uint8_t { linear, bezier, bspline, catmull_rom };

// What happens at the ends. An `open` B-spline or Catmull-Rom curve does not reach its outer control points; a `pinned`
// one begins and ends in them. A `periodic` curve is closed, and its last point is its first.
enum class CurveWrap : std::uint8_t { open, periodic, pinned };

// A point on a curve, as a weighted sum of control points. One set of them serves positions, widths and every sample in
// time of the same curve. It refers to its curve's control points by number and stays valid when they move.
struct CurvePoint {
  // Numbers of control points; they may repeat where the weight is 0.
  std::array<std::uint32_t, 4> control{};
  std::array<float, 4> weight{};
  // The point's place along the curve, counted in segments, for values that a file gives at the segments' ends.
  float segment = 0;
};

// Sums the four control values. The weights of a point on a curve sum to 1, so the value is in the units of the
// controls.
template <class Value>
Value value_at(const CurvePoint& point, std::span<const Value> of_controls) {
  Value sum = point.weight[0] * of_controls[point.control[0]];
  for (std::size_t i = 1; i < 4; ++i) sum += point.weight[i] * of_controls[point.control[i]];
  return sum;
}

// The ends of all segments, with enough points between them that the polyline stays within `tolerance` of the curve. A
// straight segment needs none between, and a linear curve is its control points. The points of a B-spline whose last
// three control points repeat its first three are closed already, and are not closed again. Returns an error where the
// basis does not allow this number of control points; these must be finite.
Result<std::vector<CurvePoint>> sample_curve(CurveBasis basis, CurveWrap wrap, std::span<const Vec3f> controls,
                                             float tolerance);

// A B-spline with knots of its own, as NURBS curves have: `order` is 2 for lines, 3 for parabolas, 4 for cubics.
// Returns an error where the knots are not as many as the control points plus the order, or where they descend. Orders
// above 4 are refused, since a point has room for four control points.
Result<std::vector<CurvePoint>> sample_knots(std::size_t order, std::span<const float> knots,
                                             std::span<const Vec3f> controls, float tolerance);

// Returns a distance that is too small to be seen in a curve of this size: 1/2000 of the way along its control points.
// Twice the tolerance saves about three tenths of the points, because their number goes with the inverse of its square
// root.
float curve_tolerance(std::span<const Vec3f> controls);

}  // namespace hairnet
