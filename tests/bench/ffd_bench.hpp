#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"

namespace hairnet::bench {

struct FfdTime {
  // Names the kind and how it is computed, such as "quadratic, stored weights".
  std::string name;
  // Is the least of many runs.
  double ns_per_point = 0;
  // Says how many times faster it is than stored weights of the same kind, in this run.
  double ratio_to_stored = 0;
  // Covers the bits of all deformed points, and of tangents where they are computed.
  std::uint64_t hash = 0;
  // Is the largest distance to the double reference over all points; for tangents it is a ratio.
  double error_max_m = 0;
};

// Times FFD of about `point_count` points of the groom: whole strands picked evenly, each with its root blend, deformed
// by one lively shape of the level's lattice, quadratic and then linear. *Stored weights* is a plain program: the 27
// (8) stored nodes and weights of each point, and a loop over them in float. *Wide* is Deformer, with the instruction
// set of this machine and with narrower ones, also with tangents. Groom and level must be valid, and the groom not
// empty.
std::vector<FfdTime> time_ffd(const Groom& groom, const Level& level, std::size_t point_count = 10'000);

}  // namespace hairnet::bench
