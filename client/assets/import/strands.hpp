#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet {

enum class Axis : std::uint8_t;  // placement.hpp

// Strands in the units and axes of their file, root first.
struct ImportedStrands {
  std::vector<Vec3f> points;
  std::vector<std::uint32_t> strand_begin{0};
  [[nodiscard]] std::size_t strand_count() const { return strand_begin.size() - 1; }

  // What else a file says of each strand; empty where it says nothing.
  std::vector<std::string> group_names;
  std::vector<std::uint16_t> groups;  // into group_names
  std::vector<float> widths;          // the mean over a strand, in units of the file
  std::vector<Vec3f> colours;         // at the root, linear RGB

  // What it says of itself.
  std::optional<Axis> up;
  std::optional<double> unit_m;

  // Lines for the user: what was read and how; and what was left out, or looks wrong.
  std::vector<std::string> notes, doubts;
};

enum class StrandFormat : std::uint8_t { yuksel_hair, tressfx, usc_data, usd };

// Every count is compared with the size of `bytes` before memory is reserved. Returns an error for non-finite points,
// truncation at any byte, and wrong magic or version.
Result<ImportedStrands> decode_yuksel_hair(std::span<const std::byte> bytes);
Result<ImportedStrands> decode_tressfx(std::span<const std::byte> bytes);  // .tfx 3.0 and 4.0
Result<ImportedStrands> decode_usc_data(std::span<const std::byte> bytes);
Result<ImportedStrands> decode_usd_curves(std::span<const std::byte> bytes);  // .usda; tells what to do with others
Result<ImportedStrands> decode_strands(StrandFormat format, std::span<const std::byte> bytes);

}  // namespace hairnet
