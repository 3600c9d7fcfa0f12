#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "core/result.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::wire {

// A groom as a file; clients upload the same bytes. Encoding is deterministic for one version of zlib. The groom must
// pass validate(). Points, vertices and bone weights are rounded (groom_numbers.hpp): what is decoded is the same groom
// within 0.05 mm, and its file is the same bytes again. fit_text changes names where they are not valid text
// (messages.hpp).
// `learnt`: hair that was learnt of it, which goes into the file; null: none.
std::vector<std::uint8_t> encode_groom(const Groom& groom, const LearntHair* learnt = nullptr);
// Reads all versions. Files of version 1 have no materials; their hair gets the material `normal`.
Result<Groom> decode_groom(std::span<const std::uint8_t> bytes, const GroomLimits& limits = {});
// The learnt hair in the file of a groom, which decode_groom ignores; null when there is none. It passes validate(),
// but whoever made the file may have learnt it from anything, so a server measures it (accept_given_hair).
Result<std::shared_ptr<const LearntHair>> decode_learnt_of_groom(std::span<const std::uint8_t> bytes);
GroomHash hash_groom(std::span<const std::uint8_t> groom_bytes);

}  // namespace hairnet::wire
