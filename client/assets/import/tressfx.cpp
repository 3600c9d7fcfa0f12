#include <string>
#include <string_view>

#include "client/assets/import/byte_reader.hpp"
#include "client/assets/import/strand_points.hpp"
#include "client/assets/import/strands.hpp"

// AMD's .tfx: f32 version, u32 strands, u32 vertices a strand, and the offset of the positions, which may be anywhere
// in the file. Other arrays may lie before or after them and are not read, so bytes beyond the positions are no error.
namespace hairnet {
namespace {

// For each version: the place of the offset of its positions, the end of its header, and the bytes after each position.
struct Layout {
  float version;
  std::size_t offset_at, header_bytes, gap_bytes;
};
// The text form begins with words, blanks or a mark of UTF-8.
constexpr std::string_view kTextBegin =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 \t\r\n#\xef\xbb\xbf";
// Version 3 has nothing between its points.
constexpr Layout kVersion3{3.0f, 144, 148, 0};
// The gap of four bytes behind each point of version 4 is an inverse mass.
constexpr Layout kVersion4{4.0f, 12, 160, 4};

Result<Layout> layout_of(float version) {
  if (version == kVersion3.version) return kVersion3;
  if (version == kVersion4.version) return kVersion4;
  return Refusal("not a .tfx file of version 3.0 or 4.0");
}

}  // namespace

Result<ImportedStrands> decode_tressfx(std::span<const std::byte> bytes) {
  // Binary files begin with their version as a float, such as 3.0f. It has zero bytes, which no text has.
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.empty() && text.substr(0, 4).find_first_not_of(kTextBegin) == std::string_view::npos)
    return decode_tressfx_text(text);
  ByteReader in(bytes);
  if (!in.has(12)) return Refusal("not a .tfx file: shorter than its counts");
  const Result<Layout> layout = layout_of(in.f32());
  if (!layout) return Refusal(layout.error());
  const std::uint32_t strand_count = in.u32();
  const std::uint32_t strand_points = in.u32();
  if (strand_count == 0) return Refusal("the file holds no strands");
  if (strand_points == 0) return Refusal("the strands have no vertices");
  if (bytes.size() < layout->header_bytes)
    return Refusal("truncated: shorter than the header of " + std::to_string(layout->header_bytes) + " bytes");

  // The offset is a number of the file: it must lead behind the header and not beyond the end.
  const std::size_t offset = ByteReader(bytes, layout->offset_at).u32();
  if (offset < layout->header_bytes || offset > bytes.size())
    return Refusal("the positions' offset " + std::to_string(offset) + " is not between the header and the file's end");
  ByteReader positions(bytes, offset);
  const std::size_t point_bytes = sizeof(float) * 3 + layout->gap_bytes;
  // The product of two numbers of 32 bits fits into 64.
  const std::uint64_t point_count = std::uint64_t{strand_count} * strand_points;
  if (!positions.has(point_count, point_bytes))
    return Refusal("truncated: " + std::to_string(strand_count) + " strands of " + std::to_string(strand_points) +
                   " vertices do not fit in the " + std::to_string(positions.remaining()) + " bytes of positions");

  ImportedStrands strands;
  strands.strand_begin.reserve(std::size_t{strand_count} + 1);
  for (std::uint32_t s = 1; s <= strand_count; ++s) strands.strand_begin.push_back(s * strand_points);
  if (const std::string error = read_points(positions, layout->gap_bytes, strands); !error.empty())
    return Refusal(error);
  return strands;
}

}  // namespace hairnet
