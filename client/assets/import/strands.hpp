#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet {

// Strands in the units and axes of their file, root first.
struct ImportedStrands {
  std::vector<Vec3f> points;
  std::vector<std::uint32_t> strand_begin{0};

  // What only some formats say. Each list is empty, or has a value for each point or for each strand.
  std::vector<float> widths;              // diameter at each point; 0: not said
  std::vector<Vec3f> colours;             // linear RGB at each point
  std::vector<Eigen::Vector2f> root_uvs;  // of each strand: where on the scalp's texture it grows
  std::vector<std::uint32_t> groups;      // of each strand, an index into group_names
  std::vector<std::string> group_names;
  std::vector<std::uint8_t> guides;  // of each strand: 1 if it only leads others

  std::vector<std::string> notes;   // lines about what was read
  std::vector<std::string> doubts;  // lines about what was left out, or taken in spite of a doubt

  [[nodiscard]] std::size_t strand_count() const { return strand_begin.size() - 1; }
};

// The points of strands at several times, in the order of the strands' own points.
struct StrandMotion {
  std::vector<double> times_s;
  std::vector<std::vector<Vec3f>> points;  // at each time
};

// One for each group of the strands, points alone, and the notes and doubts with the first; the group is the name.
// Guides beside other strands are left out, which the notes say.
struct StrandGroup {
  std::string name;  // empty: the strands have no groups
  ImportedStrands strands;
};
std::vector<StrandGroup> divide_groups(ImportedStrands strands);

enum class StrandFormat : std::uint8_t { yuksel_hair, tressfx, usc_data, alembic };

// Every count is compared with the size of `bytes` before memory is reserved. Returns an error for non-finite points,
// truncation at any byte, and wrong magic or version.
Result<ImportedStrands> decode_yuksel_hair(std::span<const std::byte> bytes);
Result<ImportedStrands> decode_tressfx(std::span<const std::byte> bytes);  // .tfx 3.0 and 4.0
Result<ImportedStrands> decode_usc_data(std::span<const std::byte> bytes);
Result<ImportedStrands> decode_strands(StrandFormat format, std::span<const std::byte> bytes);

}  // namespace hairnet
