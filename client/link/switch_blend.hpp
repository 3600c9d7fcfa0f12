#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/build/level.hpp"

namespace hairnet::link {

// A coarse level cannot show every shape of a finer one. Where a character's level changes, hair points would jump by
// the difference: it is kept, and fades over kSwitchBlend_s. One for each character and set of points; one thread.
class SwitchBlend {
 public:
  static constexpr std::int64_t kSwitchBlend_ns = 400'000'000;

  // `points_head`: as deformed by `level` for the time `time_ns` (Playout::Sample), head space, m; always as many.
  // Moves them by what is left of the last switch. A `discontinuous` moment (a teleport) or another number of points
  // begins anew.
  void apply(LevelIndex level, std::int64_t time_ns, bool discontinuous, std::span<Vec3f> points_head);

 private:
  LevelIndex level_ = LevelIndex::rigid;
  std::int64_t switched_ns_ = 0;
  std::vector<Vec3f> shown_;   // the points of the last call, as they went out
  std::vector<Vec3f> offset_;  // at the switch; empty once it has faded
};

}  // namespace hairnet::link
