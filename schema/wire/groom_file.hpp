#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/result.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::wire {

// A groom as a file; clients upload the same bytes. Encoding is deterministic. The groom must pass validate(); fit_text
// changes its names where they are not valid text (messages.hpp).
std::vector<std::uint8_t> encode_groom(const Groom& groom);
// Files of version 1 have no materials; their hair gets the material `normal`.
Result<Groom> decode_groom(std::span<const std::uint8_t> bytes, const GroomLimits& limits = {});
GroomHash hash_groom(std::span<const std::uint8_t> groom_bytes);

}  // namespace hairnet::wire
