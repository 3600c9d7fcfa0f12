#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/result.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::wire {

// A groom as a file; clients upload the same bytes. Encoding is deterministic for one version of zlib. The groom must
// pass validate(). Points, vertices and bone weights are rounded (groom_numbers.hpp): what is decoded is the same groom
// to 0.05 mm, and its file is the same bytes again. fit_text changes names where they are not valid text
// (messages.hpp).
std::vector<std::uint8_t> encode_groom(const Groom& groom);
// Reads all versions. Files of version 1 have no materials; their hair gets the material `normal`.
Result<Groom> decode_groom(std::span<const std::uint8_t> bytes, const GroomLimits& limits = {});
GroomHash hash_groom(std::span<const std::uint8_t> groom_bytes);

// The same hash of bytes that come in pieces.
class GroomHasher {
 public:
  GroomHasher();
  void add(std::span<const std::uint8_t> piece);
  [[nodiscard]] GroomHash hash() const;  // of all pieces so far

 private:
  alignas(64) std::array<std::uint8_t, 384> state_;  // of libsodium, whose header this one spares its readers
};

}  // namespace hairnet::wire
