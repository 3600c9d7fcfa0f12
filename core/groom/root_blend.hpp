#pragma once

#include <array>
#include <string>
#include <vector>

namespace hairnet {

// The root blend of a group: delta of eq. 7 as a curve over the arc length from the root, in units of lambda_0. Without
// points it is eq. 7 itself, 1 - exp(-(lambda / lambda_0)^2).
struct RootBlend {
  // (lambda / lambda_0, delta), the first value rising, the second never falling and within [0, 1]. The curve begins at
  // (0, 0), goes through all points smoothly without overshoot, and stays at the last one.
  std::vector<std::array<float, 2>> points;
};

// delta at lambda / lambda_0 >= 0.
double blend_at(const RootBlend& blend, double lambda_ratio);

inline constexpr std::size_t kRootBlendPointsMax = 64;

// Returns an empty string when valid; else one line.
std::string validate(const RootBlend& blend);

}  // namespace hairnet
