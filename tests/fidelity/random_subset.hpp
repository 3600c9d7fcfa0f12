#pragma once

#include <cstddef>
#include <cstdint>

#include "core/levels/level.hpp"

namespace hairnet::fidelity {

// The baseline that merging is compared with: `count` stiffeners chosen uniformly at random, k and q scaled up by the
// ratio of the counts. All of them, when there are no more than `count`.
Stiffeners random_subset(const Stiffeners& all, std::size_t count, std::uint64_t seed);

}  // namespace hairnet::fidelity
