#pragma once

#include <algorithm>

namespace hairnet::made {

// 0 below `low`, 1 above `high`; first and second derivatives are continuous (Perlin's quintic).
inline double smooth_step(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * t * (t * (t * 6 - 15) + 10);
}

inline double mix(double a, double b, double t) {
  return a + (b - a) * t;
}

}  // namespace hairnet::made
