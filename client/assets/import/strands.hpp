#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet {

enum class Axis : std::uint8_t;  // placement.hpp

// Strands in the units and axes of their file, root first. Points and begins always fit each other; the optional lists
// may be left out by any decoder.
struct ImportedStrands {
  std::vector<Vec3f> points;
  std::vector<std::uint32_t> strand_begin{0};

  // Only some formats have the following lists. Each list is empty, or has a value for each point or for each strand.

  // The diameter at each point; zero where the file has none.
  std::vector<float> widths;
  // Linear RGB at each point.
  std::vector<Vec3f> colours;
  // Each strand grows at this place of the scalp's texture.
  std::vector<Eigen::Vector2f> root_uvs;
  // Each strand belongs to the group with this index into group_names.
  std::vector<std::uint32_t> groups;
  std::vector<std::string> group_names;
  // For each strand: 1 if it only leads others, else 0.
  std::vector<std::uint8_t> guides;

  // What the file says of its axis upwards, and of the metres in its unit.
  std::optional<Axis> up;
  std::optional<double> unit_m;

  // Lines about what was read.
  std::vector<std::string> notes;
  // Lines about what was left out, and about what was taken although it is uncertain.
  std::vector<std::string> doubts;

  [[nodiscard]] std::size_t strand_count() const { return strand_begin.size() - 1; }
};

// The points of strands at several times, in the order of the strands' own points. Times ascend. Every list of points
// is as long as that of the strands.
struct StrandMotion {
  std::vector<double> times_s;
  // The list of points at each time.
  std::vector<std::vector<Vec3f>> points;
};

// The strands of one group, with their points alone. The first group also has what the file says of itself, the notes
// and the doubts.
struct StrandGroup {
  // Empty when the strands have no groups.
  std::string name;
  ImportedStrands strands;
  // Each strand's diameter in its middle, in the file's unit, 0 where none is said; empty: none is said at all.
  std::vector<float> widths;
};
// Divides strands into their groups. Guides beside other strands are left out, which the notes say.
std::vector<StrandGroup> divide_groups(ImportedStrands strands);

// Every count is compared with the size of `bytes` before memory is reserved. Returns an error for non-finite points,
// truncation at any byte, and wrong magic or version. They keep no view of `bytes`. Errors do not name the file, but
// the place in it.
Result<ImportedStrands> decode_yuksel_hair(std::span<const std::byte> bytes);
Result<ImportedStrands> decode_tressfx(std::span<const std::byte> bytes);  // .tfx 3.0 and 4.0, and the text of 2
Result<ImportedStrands> decode_tressfx_text(std::string_view text);
Result<ImportedStrands> decode_usc_data(std::span<const std::byte> bytes);
Result<ImportedStrands> decode_ply(std::span<const std::byte> bytes);
Result<ImportedStrands> decode_npy(std::span<const std::byte> bytes);         // .npy and .npz
Result<ImportedStrands> decode_usd_curves(std::span<const std::byte> bytes);  // text, binary, or in an archive

// Decodes the strands of a file. An .obj without lines has none.
using StrandDecoder = Result<ImportedStrands>(std::span<const std::byte> bytes);
struct StrandReader {
  std::string_view extension;
  StrandDecoder* decode;
};
// Every format of strand files, in the order of messages. A format that is added to the list is read by all programs,
// named in their messages and found in folders.
std::span<const StrandReader> strand_readers();

}  // namespace hairnet
