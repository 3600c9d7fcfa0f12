#include "core/groom/root_blend.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet {
namespace {

struct Point {
  double x = 0, y = 0;
};

// Point i of the curve; point 0 is the origin.
Point point(const RootBlend& blend, std::size_t i) {
  HAIRNET_ASSERT(i <= blend.points.size());
  if (i == 0) return {};
  return {static_cast<double>(blend.points[i - 1][0]), static_cast<double>(blend.points[i - 1][1])};
}

double slope_between(const Point& a, const Point& b) {
  HAIRNET_ASSERT(b.x > a.x);
  return (b.y - a.y) / (b.x - a.x);
}

// The slope at point i is the harmonic mean of the slopes on either side (Fritsch and Butland 1984), which keeps the
// cubic between two points monotone. It is 0 at the root and at the end of the curve.
double slope_at(const RootBlend& blend, std::size_t i) {
  if (i == 0 || i == blend.points.size()) return 0;
  const double before = slope_between(point(blend, i - 1), point(blend, i));
  const double after = slope_between(point(blend, i), point(blend, i + 1));
  return before + after > 0 ? 2 * before * after / (before + after) : 0;
}

}  // namespace

double blend_at(const RootBlend& blend, double lambda_ratio) {
  HAIRNET_ASSERT(lambda_ratio >= 0);
  // Paper eq. 7. expm1 is exact near the root, where 1 - exp would lose all digits.
  if (blend.points.empty()) return -std::expm1(-lambda_ratio * lambda_ratio);
  std::size_t next = 1;
  while (next <= blend.points.size() && point(blend, next).x <= lambda_ratio) ++next;
  if (next > blend.points.size()) return point(blend, blend.points.size()).y;
  const Point a = point(blend, next - 1), b = point(blend, next);
  HAIRNET_ASSERT(a.x <= lambda_ratio);
  HAIRNET_ASSERT(lambda_ratio < b.x);
  HAIRNET_ASSERT(a.y <= b.y);
  const double width = b.x - a.x, t = (lambda_ratio - a.x) / width;
  const double from_a = slope_at(blend, next - 1) * width, from_b = slope_at(blend, next) * width;
  // Hermite cubic.
  const double y = a.y + t * t * (3 - 2 * t) * (b.y - a.y) + t * (1 - t) * ((1 - t) * from_a - t * from_b);
  // The cubic is monotone; only rounding could leave the interval.
  return std::clamp(y, a.y, b.y);
}

std::string validate(const RootBlend& blend) {
  if (blend.points.size() > kRootBlendPointsMax)
    return "root blend has more than " + std::to_string(kRootBlendPointsMax) + " points";
  std::array<float, 2> before{0, 0};
  for (const auto& [x, y] : blend.points) {
    if (!(x > before[0] && x <= 1e4f)) return "root blend's arc lengths do not rise from 0, or end beyond 10000";
    if (!(y >= before[1] && y <= 1)) return "root blend falls, or leaves [0, 1]";
    before = {x, y};
  }
  return {};
}

}  // namespace hairnet
