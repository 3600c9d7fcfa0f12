#include <cstdint>
#include <string>

#include "client/assets/import/byte_reader.hpp"
#include "client/assets/import/strand_points.hpp"
#include "client/assets/import/strands.hpp"

// USC-HairSalon's .data: i32 strands; for each strand i32 vertices, then 3 f32 a vertex. Nothing follows the last
// strand, so further bytes mean wrong counts and are an error. Strands of one vertex mark bald places.
namespace hairnet {

Result<ImportedStrands> decode_usc_data(std::span<const std::byte> bytes) {
  // The format has signed counts. A negative one, read without a sign, is larger than this.
  constexpr std::uint32_t kMax = INT32_MAX;
  ByteReader in(bytes);
  if (!in.has(4)) return Refusal("not a .data file: shorter than its strand count");
  const std::uint32_t strand_count = in.u32();
  if (strand_count == 0) return Refusal("the file holds no strands");
  // Each strand has a count of 4 bytes at least, so a false number of strands is found before memory is reserved.
  if (strand_count > kMax || !in.has(strand_count, 4))
    return Refusal("truncated, or not a .data file: " + std::to_string(strand_count) + " strands do not fit in " +
                   std::to_string(bytes.size()) + " bytes");

  ImportedStrands strands;
  strands.strand_begin.reserve(std::size_t{strand_count} + 1);
  for (std::uint32_t s = 0; s < strand_count; ++s) {
    if (!in.has(4)) return Refusal("truncated before strand " + std::to_string(s));
    const std::uint32_t count = in.u32();
    // A strand of no vertex is accepted like a bald place; both are dropped with the strands without length.
    if (count > kMax || !in.has(count, 3 * sizeof(float)))
      return Refusal("truncated: strand " + std::to_string(s) + " says it has " + std::to_string(count) +
                     " vertices, in " + std::to_string(in.remaining()) + " bytes");
    if (const std::string error = read_strand(in, count, 0, strands); !error.empty()) return Refusal(error);
  }
  if (in.remaining() != 0)
    return Refusal("too long: " + std::to_string(in.remaining()) + " bytes follow the last strand");
  return strands;
}

}  // namespace hairnet
