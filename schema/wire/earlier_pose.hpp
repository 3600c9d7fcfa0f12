#pragma once

#include <optional>

#include "schema/wire/client_messages.hpp"

// A pose that was sent before, as it differs from a later one of its character.
namespace hairnet::wire {

// None when it differs by more than fits: by 1.6 m, 120 degrees, 4 s, or 65535 of the sequence. Asserts that it is of
// the same character.
[[nodiscard]] std::optional<EarlierPose> to_earlier(const PoseSample& earlier, const PoseSample& later);

// Positions err by at most 0.025 mm an axis, rotations by 0.1 mrad; then rounded to float. What is not finite or not of
// unit length in `later` is so in the result.
[[nodiscard]] PoseSample from_earlier(const EarlierPose& earlier, const PoseSample& later);

// The first one of the character; null: there is none.
[[nodiscard]] const PoseSample* first_of(const std::vector<PoseSample>& poses, std::uint32_t character);

}  // namespace hairnet::wire
