#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.hpp"

// The outer form of a groom file since version 3: the table Groom, deflated (PackedGroom in groom.fbs).
namespace hairnet::wire {

// `table`: a size-prefixed buffer with the table Groom. The same table gives the same bytes for one version of zlib.
std::vector<std::uint8_t> pack_groom(std::span<const std::uint8_t> table);
// Whether the file begins as a packed one; older files are the table itself.
bool is_packed_groom(std::span<const std::uint8_t> file);
// The table's bytes. Memory never exceeds kGroomBytesMax, nor about a thousand times the size of the file, which is the
// most that deflate can reach.
Result<std::vector<std::uint8_t>> unpack_groom(std::span<const std::uint8_t> file);
// The size of the table as the file says it, 0 if the file is damaged; and the file's own size if it is not packed.
std::size_t unpacked_groom_bytes(std::span<const std::uint8_t> file);

}  // namespace hairnet::wire
