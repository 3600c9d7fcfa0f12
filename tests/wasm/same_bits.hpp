#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace hairnet::same_bits {

// Runs the functions on all cases that a Writer has written, and returns their Results.
std::string results_of(std::span<const std::uint8_t> cases);

}  // namespace hairnet::same_bits
