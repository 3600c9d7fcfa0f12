#pragma once

#include <string>

#include "client/assets/import/byte_reader.hpp"
#include "client/assets/import/strands.hpp"

namespace hairnet {

// Fills `strands.points`, 3 f32 each with `gap_bytes` skipped after each, as many as `strand_begin` says. `in` must
// hold that many. Empty, or where a coordinate is not finite.
std::string read_points(ByteReader& in, std::size_t gap_bytes, ImportedStrands& strands);

// Appends the strand of `count` points that `in` holds next, checked in the same way.
std::string read_strand(ByteReader& in, std::size_t count, std::size_t gap_bytes, ImportedStrands& strands);

}  // namespace hairnet
