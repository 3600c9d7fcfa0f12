#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "client/assets/import/byte_reader.hpp"

namespace hairnet::usda {

using CrateBytes = std::span<const std::byte>;

// These unpack the tables and arrays of a crate, which is USD's binary file. Both give none for what is damaged, and
// reserve no more memory than the packed bytes can fill.

// Unpacks one block of LZ4, or several with their sizes, to at most `bytes_max` bytes.
std::optional<std::vector<std::byte>> unpack(CrateBytes packed, std::size_t bytes_max);

// Unpacks whole numbers of 4 or 8 bytes each (`bytes_of_each`). They begin with the size of their packed bytes: LZ4 of
// the differences between neighbours, each in none, a quarter, a half or all of a number's bytes. `file` is what `in`
// reads. `in` stands behind the packed bytes afterwards. No more than 16 million numbers are unpacked.
std::optional<std::vector<std::int64_t>> unpack_integers(ByteReader& in, std::uint64_t count, std::size_t bytes_of_each,
                                                         CrateBytes file);

}  // namespace hairnet::usda
