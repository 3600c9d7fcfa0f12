#pragma once

#include <cstdint>
#include <vector>

#include "tests/whole/path.hpp"

namespace hairnet::whole {

// A room that one client looks at over a line that loses packets.
struct GapsDef {
  PathQuality path;  // each way
  bool has_datagrams = true;
  double duration_s = 300;
  std::uint32_t characters = 10;
};

struct Gaps {
  // Lie between one frame of a character and its next, on arrival; ascending.
  std::vector<float> ms;
  double frame_bytes_per_s = 0;
  // Is the share of observers, looked at ten times a second, with coarser hair or fewer frames than asked for.
  double coarser_share = 0;
  // A client moves a character over such a line. These are the share of its poses that never came, and the share of
  // ticks before whose sample time the newest pose was captured.
  double poses_missing_share = 0, poses_late_share = 0;
};

// Runs a server at 30 Hz with characters at the finest level, in simulated time. The same seed gives the same gaps.
Gaps measure_gaps(const GapsDef& def, std::uint64_t seed);

}  // namespace hairnet::whole
