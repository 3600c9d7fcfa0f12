#pragma once

#include <cstddef>

#include "core/groom/groom.hpp"

namespace hairnet {

// What building all levels of a groom takes, from one pass over its points for each level. It lets a server refuse a
// groom whose levels would take too much memory, before it spends any.
struct BuildEstimate {
  // The most springs of all levels before decimation, without those of knots.
  std::size_t spring_count = 0;
  // The most memory, beside the groom itself, while all levels are built at once.
  std::size_t memory_bytes = 0;
};
// The groom must be valid and have points.
BuildEstimate estimate_build(const Groom& groom);

}  // namespace hairnet
