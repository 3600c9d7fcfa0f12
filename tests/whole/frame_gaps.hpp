#pragma once

#include <cstdint>
#include <vector>

#include "tests/whole/path.hpp"

namespace hairnet::whole {

// A room that one client looks at over a line that loses packets.
struct GapsDef {
  // The quality of the line in each direction.
  PathQuality path;
  bool has_datagrams = true;
  double duration_s = 300;
  std::uint32_t characters = 10;
};

struct Gaps {
  // The times from the arrival of one frame of a character to that of its next one, in ascending order.
  std::vector<float> ms;
  double frame_bytes_per_s = 0;
  // The server throttles an observer whose line is too slow. The measurement looks at it ten times a second. This is
  // the share of looks at which the observer had coarser hair or fewer frames than it had asked for.
  double coarser_share = 0;
  // Another client sends poses of a character over such a line. `poses_missing_share` is the share of its poses that
  // never came. `poses_late_share` is the share of ticks at which the newest pose was older than the tick's sample
  // time.
  double poses_missing_share = 0, poses_late_share = 0;
};

// Runs a server at 30 Hz with characters at the finest level, in simulated time. The same seed gives the same gaps.
Gaps measure_gaps(const GapsDef& def, std::uint64_t seed);

}  // namespace hairnet::whole
