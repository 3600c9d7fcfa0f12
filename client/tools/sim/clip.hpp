#pragma once

#include <vector>

#include "core/pose/motion.hpp"

namespace hairnet::sim {

// A motion as the input of a world: one pose a tick, rounded as on the wire. Pose 0 is that of the start.
struct Clip {
  std::vector<Pose> poses;
  std::vector<bool> teleports;        // pose i does not continue pose i - 1
  std::size_t motion_tick_count = 0;  // the ticks after these belong to the settling

  [[nodiscard]] std::size_t tick_count() const { return poses.size() - 1; }
};

// `settle_s` more seconds let the head ease upright (its place and heading stay) within 1 s and then rest.
Clip make_clip(const Motion& motion, double rate_hz, double settle_s);

}  // namespace hairnet::sim
