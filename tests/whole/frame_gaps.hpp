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
  std::vector<float> ms;  // from one frame of a character to its next, on arrival; ascending
  double frame_bytes_per_s = 0;
  double coarser_share = 0;  // of ticks at which hair was coarser, or frames fewer, than asked for
  // Of a client that moves a character over such a line: the share of its poses that never came, and the share of ticks
  // before whose sample time the newest pose was captured.
  double poses_missing_share = 0, poses_late_share = 0;
};

// Runs a server at 30 Hz with characters at the finest level, in simulated time. The same seed gives the same gaps.
Gaps measure_gaps(const GapsDef& def, std::uint64_t seed);

}  // namespace hairnet::whole
