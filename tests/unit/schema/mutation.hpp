#pragma once

#include <cstdint>
#include <random>
#include <vector>

namespace hairnet::wire {

// `bytes`, not none, spoilt in one place to four: bits, counts and offsets, pieces over others, an end too early or bytes
// too many. A size prefix agrees with what became of them, mostly, or nothing else would ever be looked at.
std::vector<std::uint8_t> mutated(std::mt19937& random, std::vector<std::uint8_t> bytes);

}  // namespace hairnet::wire
