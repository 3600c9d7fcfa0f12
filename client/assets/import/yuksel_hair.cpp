#include <algorithm>
#include <cmath>
#include <string>

#include "client/assets/import/byte_reader.hpp"
#include "client/assets/import/strand_points.hpp"
#include "client/assets/import/strands.hpp"

// Cem Yuksel's .hair: a header of 128 bytes, then the arrays that its bits name, in bit order.
namespace hairnet {
namespace {

constexpr std::size_t kHeaderBytes = 128;
constexpr std::uint32_t kMagic = 0x52494148;  // "HAIR"
// The bits of the arrays that follow the header, in this order.
constexpr std::uint32_t kSegmentsBit = 1, kPointsBit = 2, kThicknessBit = 4, kTransparencyBit = 8, kColourBit = 16;

struct Header {
  std::uint32_t strand_count, point_count, arrays, default_segments;
  float default_thickness;
};

Result<Header> read_header(ByteReader& in) {
  if (!in.has(kHeaderBytes)) return Refusal("not a .hair file: shorter than the header of 128 bytes");
  if (in.u32() != kMagic) return Refusal("not a .hair file: it does not begin with HAIR");
  Header header{};
  header.strand_count = in.u32();
  header.point_count = in.u32();
  header.arrays = in.u32();
  header.default_segments = in.u32();
  header.default_thickness = in.f32();
  // Transparency, colour and information are not used.
  in.skip(kHeaderBytes - in.at());
  if (header.strand_count == 0) return Refusal("the file holds no strands");
  if ((header.arrays & kPointsBit) == 0) return Refusal("the file holds no points");
  if (header.arrays >= 2 * kColourBit)
    return Refusal("array bits " + std::to_string(header.arrays) + " name an array this format does not have");
  return header;
}

// Returns the bytes of all arrays, in 64 bits, which counts of 32 bits cannot overflow. Comparing this number with the
// file's size at once makes all later reads safe.
std::uint64_t array_bytes(const Header& header) {
  const auto per_point = [&](std::uint32_t bit, std::uint64_t bytes) {
    return (header.arrays & bit) != 0 ? bytes * header.point_count : 0;
  };
  const std::uint64_t segments = (header.arrays & kSegmentsBit) != 0 ? std::uint64_t{2} * header.strand_count : 0;
  return segments + per_point(kPointsBit, 12) + per_point(kThicknessBit, 4) + per_point(kTransparencyBit, 4) +
         per_point(kColourBit, 12);
}

std::string points_do_not_add_up(std::uint64_t by_segments, std::uint32_t by_header) {
  return "the strands' segments make " + std::to_string(by_segments) + " points, but the header says " +
         std::to_string(by_header);
}

// A thickness that is no length counts as unknown: it is no reason to lose the strand.
float known_width(float thickness) {
  return std::isfinite(thickness) ? std::max(thickness, 0.0f) : 0;
}

}  // namespace

Result<ImportedStrands> decode_yuksel_hair(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  const Result<Header> header = read_header(in);
  if (!header) return Refusal(header.error());
  if (const std::uint64_t expected = array_bytes(*header); in.remaining() != expected)
    return Refusal((in.remaining() < expected ? "truncated: " : "too long: ") + std::to_string(in.remaining()) +
                   " bytes of arrays where the header makes it " + std::to_string(expected));

  const bool has_segments = (header->arrays & kSegmentsBit) != 0;
  if (!has_segments) {
    // Checked before anything is reserved: without a segments array nothing else bounds the strand count.
    const std::uint64_t points = (std::uint64_t{header->default_segments} + 1) * header->strand_count;
    if (points != header->point_count) return Refusal(points_do_not_add_up(points, header->point_count));
  }
  ImportedStrands strands;
  strands.strand_begin.reserve(std::size_t{header->strand_count} + 1);
  // Each strand has one point more than segments. The sum is in 64 bits and is checked at every strand, so it cannot
  // wrap.
  std::uint64_t end = 0;
  for (std::uint32_t s = 0; s < header->strand_count; ++s) {
    end += std::uint64_t{has_segments ? in.u16() : header->default_segments} + 1;
    if (end > header->point_count) return Refusal(points_do_not_add_up(end, header->point_count));
    strands.strand_begin.push_back(static_cast<std::uint32_t>(end));
  }
  if (end != header->point_count) return Refusal(points_do_not_add_up(end, header->point_count));
  if (const std::string error = read_points(in, 0, strands); !error.empty()) return Refusal(error);
  const bool has_thickness = (header->arrays & kThicknessBit) != 0;
  if (has_thickness || known_width(header->default_thickness) > 0) {
    for (std::uint32_t i = 0; i < header->point_count; ++i)
      strands.widths.push_back(known_width(has_thickness ? in.f32() : header->default_thickness));
  }
  return strands;
}

}  // namespace hairnet
