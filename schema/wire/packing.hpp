#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.hpp"
#include "schema/bytes/deflate.hpp"

// The outer form of groom files since version 3, of basis files and of those of learnt hair: a table, deflated
// (PackedTable in types.fbs).
namespace hairnet::wire {

// Identifiers of packed files.
inline constexpr const char* kPackedGroom = "HNGZ";
inline constexpr const char* kPackedBasis = "HNBZ";
inline constexpr const char* kPackedLearnt = "HNLZ";

using bytes::PackEffort;

// `table`: a size-prefixed buffer. The same table gives the same bytes for one version of zlib.
std::vector<std::uint8_t> pack(std::span<const std::uint8_t> table, const char* identifier,
                               PackEffort effort = PackEffort::quick);
// Whether the file begins as a packed one; older files are the table itself.
bool is_packed(std::span<const std::uint8_t> file, const char* identifier);
// The table's bytes. Memory never exceeds kGroomBytesMax, nor about a thousand times the size of the file, which is the
// most that deflate can reach.
Result<std::vector<std::uint8_t>> unpack(std::span<const std::uint8_t> file, const char* identifier);
// The size of the table as the file says it, 0 if the file is damaged; and the file's own size if it is not packed.
std::size_t unpacked_bytes(std::span<const std::uint8_t> file, const char* identifier);

}  // namespace hairnet::wire
