#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/build/stiffener_list.hpp"

namespace hairnet {

// Both ends in a row, in grid coordinates, the axis of greatest extent ascending: springs along one line compare alike,
// whichever way their strands run.
using EndPoints = std::array<double, 6>;
EndPoints ordered_ends(const std::array<Vec3, 2>& ends);

// Pairs (first < second) in which one is among the `neighbour_count` nearest of the other by its two ends, whichever
// way round the ends are, among `members` (indices into the list). Distances in node spacings. Sorted, each pair once.
// Takes quadratic time where many have the very same ends: merge those first.
std::vector<std::pair<std::uint32_t, std::uint32_t>> nearest_pairs(const StiffenerList& list,
                                                                   std::span<const std::uint32_t> members,
                                                                   std::size_t neighbour_count);

}  // namespace hairnet
