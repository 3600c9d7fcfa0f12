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

// Times FFD of about `point_count` points of the groom: whole strands picked evenly, each with its root blend, deformed
// by one lively shape of the level's lattice, quadratic and then linear. *Stored weights* is a plain program: the 27
// (8) stored nodes and weights of each point, and a loop over them in float. *Wide* is Deformer, with the instruction
// set of this machine and with narrower ones, also with tangents. Groom and level must be valid, and the groom not
// empty.
std::vector<FfdTime> time_ffd(const Groom& groom, const Level& level, std::size_t point_count = 10'000);

}  // namespace hairnet::bench
