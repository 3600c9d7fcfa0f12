#pragma once

#include <cstdint>
#include <random>
#include <vector>

namespace hairnet::wire {

// Damages non-empty `bytes` in one to four places: bits, counts, offsets, copied pieces, truncation, extra bytes.
// Usually corrects the size prefix afterwards, where the bytes had one, or the decoder would stop there.
std::vector<std::uint8_t> mutated(std::mt19937& random, std::vector<std::uint8_t> bytes);

}  // namespace hairnet::wire
