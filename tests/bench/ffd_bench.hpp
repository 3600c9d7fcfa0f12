#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"

namespace hairnet::bench {

struct FfdTime {
  std::string name;            // "quadratic, stored weights" …
  double ns_per_point = 0;     // the least of many runs
  double ratio_to_stored = 0;  // how many times faster than stored weights of the same kind, in this run
  std::uint64_t hash = 0;      // of the bits of all deformed points (and tangents)
  double error_max_m = 0;      // from the double reference, over all points; of tangents a ratio
};

// FFD of about `point_count` points of the groom, whole strands evenly picked from all of it, each with its root blend,
// by one lively shape of the level's lattice: quadratic, then linear. *Stored weights* is what a plain program does:
// the 27 (8) nodes and weights of each point, kept, and a loop over them in float. *Wide* is Deformer, by the
// instruction set of this machine and by narrower ones; with tangents, too. Groom and level must be sound, and the
// groom not empty.
std::vector<FfdTime> time_ffd(const Groom& groom, const Level& level, std::size_t point_count = 10'000);

}  // namespace hairnet::bench
