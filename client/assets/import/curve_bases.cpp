#include "client/assets/import/curve_bases.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace hairnet {
namespace {

// A segment has at most this many pieces. A crafted segment with distant control points could otherwise ask for
// millions of points.
constexpr int kPiecesMax = 64;

// Weights of a segment's four control points: row k holds the coefficients of t to the power k.
using BasisMatrix = std::array<std::array<double, 4>, 4>;
// The matrices are those of the cubic Bezier curve, of the uniform cubic B-spline and of the Catmull-Rom spline with a
// tension of 1/2.
constexpr BasisMatrix kBezier{{{1, 0, 0, 0}, {-3, 3, 0, 0}, {3, -6, 3, 0}, {-1, 3, -3, 1}}};
constexpr BasisMatrix kBspline{{{1. / 6, 4. / 6, 1. / 6, 0},
                                {-3. / 6, 0, 3. / 6, 0},
                                {3. / 6, -6. / 6, 3. / 6, 0},
                                {-1. / 6, 3. / 6, -3. / 6, 1. / 6}}};
constexpr BasisMatrix kCatmullRom{{{0, 1, 0, 0}, {-0.5, 0, 0.5, 0}, {1, -2.5, 2, -0.5}, {-0.5, 1.5, -1.5, 0.5}}};

const BasisMatrix& matrix_of(CurveBasis basis) {
  if (basis == CurveBasis::bezier) return kBezier;
  return basis == CurveBasis::bspline ? kBspline : kCatmullRom;
}

const char* name_of(CurveBasis basis) {
  constexpr std::array<const char*, 4> kNames{"linear", "Bezier", "B-spline", "Catmull-Rom"};
  return kNames[static_cast<std::size_t>(basis)];
}

// The message for a number of control points that the basis cannot have. `possible` lists the numbers that it can.
Refusal impossible(CurveBasis basis, CurveWrap wrap, std::size_t count, const std::string& possible) {
  return Refusal("has " + std::to_string(count) + (count == 1 ? " point" : " points") + ", where a " +
                 (wrap == CurveWrap::periodic ? "closed " : "") + name_of(basis) + " curve has " + possible);
}

// Adds a weight for a control point. A point already in the list gets the sum, since ends that continue straight name
// inner points twice and a list has room for four.
void add_weight(CurvePoint& point, std::size_t& used, std::size_t control, double weight) {
  const auto index = static_cast<std::uint32_t>(control);
  const auto end = point.control.begin() + static_cast<std::ptrdiff_t>(used);
  const auto slot = std::find(point.control.begin(), end, index);
  const auto at = static_cast<std::size_t>(slot - point.control.begin());
  if (slot == end) point.control[used++] = index;
  point.weight[at] += static_cast<float>(weight);
}

// How many chords stay within `tolerance` of a cubic over a step of 1, from the second derivatives at its ends: they
// are its largest, and a chord over a step of h is within h²/8 of them. The square root of the second derivative over 8
// tolerances is the number of steps h = 1 / n that meets the bound.
int pieces_of(double second_derivative, float tolerance) {
  // The comparison in this direction also gives 1 for NaN.
  const double pieces = std::ceil(std::sqrt(second_derivative / (8 * double{tolerance})));
  return pieces >= 1 ? static_cast<int>(std::min(pieces, double{kPiecesMax})) : 1;
}

// A curve of cubic segments over control points that may lie before the first and behind the last: a periodic curve
// goes round, a pinned one continues straight on. `first` may be negative: the segment then begins before the first
// control point.
struct Segments {
  const BasisMatrix* matrix;
  CurveWrap wrap;
  std::size_t count, controls;
  // The first segment begins at control point `first`, and each next one `step` control points later.
  std::ptrdiff_t first, step;

  [[nodiscard]] CurvePoint combine(std::size_t segment, const std::array<double, 4>& weights) const {
    CurvePoint point;
    std::size_t used = 0;
    const auto n = static_cast<std::ptrdiff_t>(controls);
    for (std::size_t i = 0; i < 4; ++i) {
      const std::ptrdiff_t at = first + step * static_cast<std::ptrdiff_t>(segment) + static_cast<std::ptrdiff_t>(i);
      if (wrap == CurveWrap::periodic) {
        add_weight(point, used, static_cast<std::size_t>((at + n) % n), weights[i]);
      } else if (at < 0 || at >= n) {
        // The control point beyond a pinned end is 2 p_0 - p_1, which makes the curve begin exactly in p_0. The same
        // holds at the other end.
        const std::size_t end = at < 0 ? 0 : controls - 1, inner = at < 0 ? 1 : controls - 2;
        add_weight(point, used, end, 2 * weights[i]);
        add_weight(point, used, inner, -weights[i]);
      } else {
        add_weight(point, used, static_cast<std::size_t>(at), weights[i]);
      }
    }
    return point;
  }

  [[nodiscard]] CurvePoint at(std::size_t segment, double t) const {
    std::array<double, 4> weights{};
    for (std::size_t i = 0; i < 4; ++i) {
      const BasisMatrix& m = *matrix;
      weights[i] = m[0][i] + t * (m[1][i] + t * (m[2][i] + t * m[3][i]));
    }
    CurvePoint point = combine(segment, weights);
    point.segment = static_cast<float>(static_cast<double>(segment) + t);
    return point;
  }

  [[nodiscard]] int pieces(std::size_t segment, std::span<const Vec3f> points, float tolerance) const {
    double largest = 0;
    // The second derivative of a cubic is linear in t, so one of the ends has the largest.
    for (const double t : {0., 1.}) {
      std::array<double, 4> weights{};
      for (std::size_t i = 0; i < 4; ++i) weights[i] = 2 * (*matrix)[2][i] + 6 * t * (*matrix)[3][i];
      largest = std::max(largest, double{value_at(combine(segment, weights), points).norm()});
    }
    return pieces_of(largest, tolerance);
  }
};

// The part of a curve between two knots that differ.
struct KnotSpan {
  std::size_t order, span;
  std::span<const float> knots;

  // By the recursion of de Boor and Cox, from the one function of order 1 that is not 0 here. Weights are valid for
  // this span alone, where exactly `order` functions are not 0.
  [[nodiscard]] CurvePoint at(std::size_t segment, double t) const {
    const double u = (1 - t) * double{knots[span]} + t * double{knots[span + 1]};
    std::array<double, 4> weights{1, 0, 0, 0};
    for (std::size_t degree = 1; degree < order; ++degree) {
      double carried = 0;
      for (std::size_t i = 0; i < degree; ++i) {
        const double right = double{knots[span + 1 + i]}, left = double{knots[span + 1 + i - degree]};
        const double share = weights[i] / (right - left);
        weights[i] = carried + (right - u) * share;
        carried = (u - left) * share;
      }
      weights[degree] = carried;
    }
    CurvePoint point;
    for (std::size_t i = 0; i < order; ++i) {
      point.control[i] = static_cast<std::uint32_t>(span + 1 - order + i);
      point.weight[i] = static_cast<float>(weights[i]);
    }
    point.segment = static_cast<float>(static_cast<double>(segment) + t);
    return point;
  }

  // Returns the larger length of the second derivative at the two ends. It changes linearly between them, so second
  // differences of four evenly spaced points give both.
  [[nodiscard]] double second_derivative(std::span<const Vec3f> controls) const {
    std::array<Vec3, 4> x;
    for (std::size_t i = 0; i < 4; ++i) x[i] = value_at(at(0, static_cast<double>(i) / 3), controls).cast<double>();
    const Vec3 before = x[0] - 2 * x[1] + x[2], behind = x[1] - 2 * x[2] + x[3];
    return 9 * std::max((2 * before - behind).norm(), (2 * behind - before).norm());
  }
};

// Whether the last `count` control points repeat the first. Some exporters close a curve so, although the flag already
// says that it is closed.
bool ends_repeat(std::span<const Vec3f> controls, std::size_t count) {
  return controls.size() >= 2 * count && std::ranges::equal(controls.first(count), controls.last(count));
}

Result<Segments> segments_of(CurveBasis basis, CurveWrap wrap, std::span<const Vec3f> controls) {
  const std::size_t n = controls.size();
  if (basis == CurveBasis::bezier) {
    if (wrap == CurveWrap::periodic && n % 3 == 0 && n >= 3)
      return Segments{&kBezier, CurveWrap::periodic, n / 3, n, 0, 3};
    // A closed Bezier curve may repeat its first point at the end, or leave it out. All other counts are refused, since
    // a segment has 3 points.
    const bool is_closed = wrap != CurveWrap::periodic || ends_repeat(controls, 1);
    if (!is_closed || n < 4 || n % 3 != 1)
      return impossible(basis, wrap, n, wrap == CurveWrap::periodic ? "3, 6, 9, ..." : "4, 7, 10, ...");
    return Segments{&kBezier, CurveWrap::open, (n - 1) / 3, n, 0, 3};
  }
  // A B-spline of n points has n - 3 segments when open, n - 1 when pinned, and n when closed. Catmull-Rom curves have
  // the same numbers.
  const BasisMatrix* matrix = &matrix_of(basis);
  if (wrap == CurveWrap::periodic && !(n >= 6 && ends_repeat(controls, 3))) {
    // A closed Catmull-Rom curve begins in its first point only if the first segment starts one point earlier.
    if (n < 3) return impossible(basis, wrap, n, "at least 3");
    return Segments{matrix, wrap, n, n, basis == CurveBasis::bspline ? 0 : -1, 1};
  }
  if (wrap == CurveWrap::pinned) {
    if (n < 2) return impossible(basis, wrap, n, "at least 2");
    return Segments{matrix, wrap, n - 1, n, -1, 1};
  }
  if (n < 4) return impossible(basis, wrap, n, "at least 4");
  return Segments{matrix, CurveWrap::open, n - 3, n, 0, 1};
}

Result<std::vector<CurvePoint>> control_points(CurveWrap wrap, std::span<const Vec3f> controls) {
  const std::size_t n = controls.size();
  if (n < 2) return impossible(CurveBasis::linear, wrap, n, "at least 2");
  std::vector<CurvePoint> points(n);
  for (std::size_t i = 0; i < n; ++i)
    points[i] = {{static_cast<std::uint32_t>(i), 0, 0, 0}, {1, 0, 0, 0}, static_cast<float>(i)};
  if (wrap == CurveWrap::periodic && controls.front() != controls.back())
    points.push_back({{}, {1, 0, 0, 0}, static_cast<float>(n)});
  return points;
}

}  // namespace

Result<std::vector<CurvePoint>> sample_curve(CurveBasis basis, CurveWrap wrap, std::span<const Vec3f> controls,
                                             float tolerance) {
  if (basis == CurveBasis::linear) return control_points(wrap, controls);
  const Result<Segments> segments = segments_of(basis, wrap, controls);
  if (!segments) return Refusal(segments.error());
  // Each segment adds the points behind its begin, so no point occurs twice.
  std::vector<CurvePoint> points{segments->at(0, 0)};
  for (std::size_t s = 0; s < segments->count; ++s) {
    const int pieces = segments->pieces(s, controls, tolerance);
    for (int i = 1; i <= pieces; ++i) points.push_back(segments->at(s, static_cast<double>(i) / pieces));
  }
  return points;
}

Result<std::vector<CurvePoint>> sample_knots(std::size_t order, std::span<const float> knots,
                                             std::span<const Vec3f> controls, float tolerance) {
  if (order < 2 || order > 4) return Refusal("is of order " + std::to_string(order) + ", and only 2 to 4 are read");
  if (controls.size() < order || knots.size() != controls.size() + order)
    return Refusal("has " + std::to_string(controls.size()) + " points and " + std::to_string(knots.size()) +
                   " knots, which must be " + std::to_string(order) + " more than the points");
  const bool ascend =
      std::ranges::all_of(knots, [](float knot) { return std::isfinite(knot); }) && std::ranges::is_sorted(knots);
  // The curve covers the knots from order - 1 to the number of controls; an interval of no length there has no point.
  if (!ascend || !(knots[order - 1] < knots[controls.size()])) return Refusal("has knots that do not ascend");
  std::vector<CurvePoint> points;
  std::size_t segment = 0;
  for (std::size_t span = order - 1; span < controls.size(); ++span) {
    // Repeated knots make spans without length. They have no points, and division by their length would fail.
    if (!(knots[span] < knots[span + 1])) continue;
    const KnotSpan piece{order, span, knots};
    if (points.empty()) points.push_back(piece.at(0, 0));
    // A span of order 2 is a straight line between control points and needs no pieces.
    const int pieces = order == 2 ? 1 : pieces_of(piece.second_derivative(controls), tolerance);
    for (int i = 1; i <= pieces; ++i) points.push_back(piece.at(segment, static_cast<double>(i) / pieces));
    ++segment;
  }
  return points;
}

float curve_tolerance(std::span<const Vec3f> controls) {
  double length = 0;
  for (std::size_t i = 1; i < controls.size(); ++i) length += (controls[i] - controls[i - 1]).cast<double>().norm();
  // On 20 cm of hair the share is 0.1 mm, about the diameter of a hair.
  return static_cast<float>(length / 2000);
}

}  // namespace hairnet
