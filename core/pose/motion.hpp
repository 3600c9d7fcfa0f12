#pragma once

#include <string>
#include <vector>

#include "core/pose/pose.hpp"

namespace hairnet {

// A clip: poses at a fixed rate from time 0.
struct Motion {
  std::string name;
  double rate_hz = 60;
  // The poses in order, at least one.
  std::vector<Pose> poses;
  // One flag for each pose, whether it does not continue the pose before; empty means never.
  std::vector<bool> teleports;

  [[nodiscard]] double duration_s() const {
    return poses.empty() ? 0 : (static_cast<double>(poses.size()) - 1) / rate_hz;
  }
  // Interpolates between poses, except across a teleport. Times before the first pose or after the last are clamped.
  // Asserts that there is a pose, that the rate is positive and that the time is a number.
  [[nodiscard]] Pose sample(double time_s) const;
  // Whether a teleport lies in (from_s, to_s].
  [[nodiscard]] bool teleports_within(double from_s, double to_s) const;
};

}  // namespace hairnet
