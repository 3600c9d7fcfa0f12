#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace hairnet::bytes {

// The checksum of zip archives, of bytes that follow those with the checksum `before`.
std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t before = 0);
// Joins the checksums of two pieces, one behind the other. The second has `second_bytes`.
std::uint32_t crc32_joined(std::uint32_t first, std::uint32_t second, std::uint64_t second_bytes);

}  // namespace hairnet::bytes
