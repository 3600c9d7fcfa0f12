#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"

namespace hairnet::bench {

struct FfdTime {
  // The kind of FFD and how it is computed, such as "quadratic, stored weights".
  std::string name;
  // The shortest time of many runs.
  double ns_per_point = 0;
  // How many times faster it is than stored weights of the same kind, measured in the same run of the program.
  double ratio_to_stored = 0;
  // A hash of the bits of all deformed points, and of tangents where they are computed.
  std::uint64_t hash = 0;
  // The largest distance of a point, in metres, or of a tangent from the reference in doubles.
  double error_max_m = 0;
};

// Times FFD of about `point_count` points of the groom: whole strands picked evenly, each with its root blend, deformed
// by one lively shape of the level's lattice, quadratic and then linear. *Stored weights* is a plain program: the 27
// (8) stored nodes and weights of each point, and a loop over them in float. *Wide* is Deformer, with the instruction
// set of this machine and with narrower ones, also with tangents. Groom and level must be valid, and the groom not
// empty.
std::vector<FfdTime> time_ffd(const Groom& groom, const Level& level, std::size_t point_count = 10'000);

}  // namespace hairnet::bench
