#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hairnet::made {

// 0 below `low`, 1 above `high`; first and second derivatives are continuous (Perlin's quintic). A jump in the
// acceleration of a head would show as a twitch of the hair.
inline double smootherstep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * t * (t * (t * 6 - 15) + 10);
}

// The integral of smootherstep from `low` to x: the distance covered while the speed rises from 0 to 1 between them.
inline double smootherstep_integral(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return (high - low) * t * t * t * t * (t * (t - 3) + 2.5) + std::max(0.0, x - high);
}

// A sine of `hz`, its phase in turns.
inline double wave(double hz, double t, double phase = 0) {
  return std::sin(2 * std::numbers::pi * (hz * t + phase));
}

// 1 at x = 0, 0 from |x| = 1/2 on, smooth to its third derivative.
inline double bump(double x) {
  return std::abs(x) < 0.5 ? std::pow(std::cos(std::numbers::pi * x), 4) : 0;
}

// Linear interpolation, which extrapolates for t outside of [0, 1].
inline double mix(double a, double b, double t) {
  return a + (b - a) * t;
}

}  // namespace hairnet::made
