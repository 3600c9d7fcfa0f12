#pragma once

#include <algorithm>

namespace hairnet {

// Rises from 0 at t = 0 to 1 at t = 1, with a slope of 0 at both ends. `t` lies in [0, 1].
template <class T>
constexpr T smoothstep(T t) {
  return t * t * (3 - 2 * t);
}

// Rises in the same way while x goes from `low` to `high`: 0 below, 1 above. NaN stays NaN.
template <class T>
constexpr T smoothstep(T low, T high, T x) {
  return smoothstep(std::clamp((x - low) / (high - low), T{0}, T{1}));
}

}  // namespace hairnet
