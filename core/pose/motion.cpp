#include "core/pose/motion.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet {

Pose Motion::sample(double time_s) const {
  HAIRNET_ASSERT(!poses.empty());
  HAIRNET_ASSERT(rate_hz > 0);
  HAIRNET_ASSERT(teleports.empty() || teleports.size() == poses.size());
  HAIRNET_ASSERT(!std::isnan(time_s));
  const double last = static_cast<double>(poses.size()) - 1;
  const double at = std::clamp(time_s * rate_hz, 0.0, last);
  const auto before = static_cast<std::size_t>(at);
  const std::size_t after = std::min(before + 1, poses.size() - 1);
  HAIRNET_ASSERT(before <= after);
  // Interpolating across a cut would show poses that nobody took.
  if (!teleports.empty() && teleports[after]) return poses[at < static_cast<double>(after) ? before : after];
  return interpolate(poses[before], poses[after], at - static_cast<double>(before));
}

bool Motion::teleports_within(double from_s, double to_s) const {
  HAIRNET_ASSERT(rate_hz > 0);
  for (std::size_t i = 0; i < teleports.size(); ++i) {
    const double at_s = static_cast<double>(i) / rate_hz;
    if (teleports[i] && at_s > from_s && at_s <= to_s) return true;
  }
  return false;
}

}  // namespace hairnet
