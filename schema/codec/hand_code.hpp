#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/touch/hand.hpp"

// A person's hands as bits: a hand of six capsules takes less than 60 bytes.
namespace hairnet::codec {

// The step of all lengths.
inline constexpr double kHandStep_m = 0.001;

// Places, ends and radii are rounded to kHandStep_m, rotations to 0.25 mrad. A radius of less than half a step becomes
// one step. Valid hands take at most wire::kHandsBytesMax. Asserts that the hands are valid (validate).
std::vector<std::uint8_t> encode_hands(std::span<const Hand> hands);

// Returns an empty string, or one line about what is wrong: hands that are decoded are valid.
std::string decode_hands(std::span<const std::uint8_t> bytes, std::vector<Hand>& hands);

// The hands as decode_hands gives them after encode_hands.
std::vector<Hand> rounded_to_wire(std::span<const Hand> hands);

}  // namespace hairnet::codec
