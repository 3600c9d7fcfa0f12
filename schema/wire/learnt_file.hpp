#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/learnt/learnt_hair.hpp"
#include "core/result.hpp"

namespace hairnet::wire {

// A groom's learnt hair as a file, which clients download by its hash as they do grooms: without what it knows of wind.
// Deterministic for one version of zlib. Asserts that the hair is valid.
std::vector<std::uint8_t> encode_learnt(const LearntHair& hair);
// Any bytes: valid learnt hair, or a refusal of one line.
Result<LearntHair> decode_learnt(std::span<const std::uint8_t> bytes);

}  // namespace hairnet::wire
