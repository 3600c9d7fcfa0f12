#pragma once

#include <vector>

#include "core/pose/motion.hpp"

namespace hairnet::sim {

// A motion as the input of a world: one pose a tick, rounded as on the wire. Pose 0 is that of the start, before the
// first tick. Unlike MotionTimeline it has no lead-in, and does not loop.
struct Clip {
  std::vector<Pose> poses;
  // Pose i does not continue pose i - 1.
  std::vector<bool> teleports;
  // The ticks after these belong to the settling.
  std::size_t motion_tick_count = 0;

  [[nodiscard]] std::size_t tick_count() const { return poses.size() - 1; }
};

// `rate_hz` must be positive. `settle_s` more seconds let the head ease upright (its place and heading stay) within 1 s
// and then rest.
Clip make_clip(const Motion& motion, double rate_hz, double settle_s);

}  // namespace hairnet::sim
