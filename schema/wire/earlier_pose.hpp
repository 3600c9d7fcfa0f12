#pragma once

#include <optional>

#include "schema/wire/client_messages.hpp"

// A pose that was sent before, as it differs from a later one of its character.
namespace hairnet::wire {

// Returns none when the poses differ by more than fits: by 1.6 m, 120 degrees, 4 s, or 65535 of the sequence. Asserts
// that both are of the same character.
[[nodiscard]] std::optional<EarlierPose> to_earlier(const PoseSample& earlier, const PoseSample& later);

// Positions err by at most 0.025 mm an axis, rotations by 0.1 mrad; then rounded to float. What is not finite or not of
// unit length in `later` is so in the result.
[[nodiscard]] PoseSample from_earlier(const EarlierPose& earlier, const PoseSample& later);

// Returns the first pose of the character, or null when there is none.
[[nodiscard]] const PoseSample* first_of(const std::vector<PoseSample>& poses, std::uint32_t character);

}  // namespace hairnet::wire
