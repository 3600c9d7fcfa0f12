#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/build/stiffener_list.hpp"

namespace hairnet {

// Pairs (first < second) in which one is among the `neighbour_count` nearest of the other by its two ends, whichever
// way round the ends are, among `members` (indices into the list). Distances in node spacings. Sorted, each pair once.
std::vector<std::pair<std::uint32_t, std::uint32_t>> nearest_pairs(const StiffenerList& list,
                                                                   std::span<const std::uint32_t> members,
                                                                   std::size_t neighbour_count);

}  // namespace hairnet
