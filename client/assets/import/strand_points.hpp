#pragma once

#include <string>

#include "client/assets/import/byte_reader.hpp"
#include "client/assets/import/strands.hpp"

namespace hairnet {

// Fills `strands.points`, 3 f32 each, skipping `gap_bytes` after each; `strand_begin` gives their number. `in` must
// have that many. Returns an empty string, or the place of a coordinate that is not finite. The caller has compared the
// count with the size of the file, which is why the reader may read without checks.
std::string read_points(ByteReader& in, std::size_t gap_bytes, ImportedStrands& strands);

// Appends the next strand of `count` points from `in`, checked in the same way.
std::string read_strand(ByteReader& in, std::size_t count, std::size_t gap_bytes, ImportedStrands& strands);

}  // namespace hairnet
