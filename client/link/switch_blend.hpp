#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/levels/level.hpp"

namespace hairnet::link {

// Cross-fades hair points when a character's level changes. A coarse level cannot show every shape of a finer one, so
// points would jump at the switch. This adds the difference back and lets it fade over kSwitchBlend_ns. One object per
// character and set of points; one thread.
class SwitchBlend {
 public:
  static constexpr std::int64_t kSwitchBlend_ns = 400'000'000;
  // The share of a switch's difference that is left after `elapsed_ns`: 1 to 0, along a smooth curve.
  static float left_after(std::int64_t elapsed_ns);

  // Adds the part of the last switch that has not faded yet. `points_head`: the points that `level` gives at the time
  // `time_ns` (Playout::Sample), head space, m; the same number in each call. A `discontinuous` moment, or another
  // number of points, ends the fade.
  void apply(LevelIndex level, std::int64_t time_ns, bool discontinuous, std::span<Vec3f> points_head);

 private:
  LevelIndex level_ = LevelIndex::rigid;
  std::int64_t switched_ns_ = 0;
  std::vector<Vec3f> shown_;   // the result of the last call
  std::vector<Vec3f> offset_;  // at the switch; empty once it has faded
};

}  // namespace hairnet::link
