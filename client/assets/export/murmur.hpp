#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace hairnet {

using MurmurDigest = std::array<std::uint64_t, 2>;

// MurmurHash3, the variant of 128 bits for x64 with seed 0. Alembic tells samples apart by it. It is fast and has no
// protection against someone who looks for two texts of one digest.
MurmurDigest murmur_128(std::span<const std::byte> bytes);

}  // namespace hairnet
