#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet {

// Strands in the units and axes of their file, root first.
struct ImportedStrands {
  std::vector<Vec3f> points;
  std::vector<std::uint32_t> strand_begin{0};
  [[nodiscard]] std::size_t strand_count() const { return strand_begin.size() - 1; }
};

enum class StrandFormat : std::uint8_t { yuksel_hair, tressfx, usc_data };

// Every count is compared with the size of `bytes` before memory is reserved. Returns an error for non-finite points,
// truncation at any byte, and wrong magic or version.
Result<ImportedStrands> decode_yuksel_hair(std::span<const std::byte> bytes);
Result<ImportedStrands> decode_tressfx(std::span<const std::byte> bytes);  // .tfx 3.0 and 4.0
Result<ImportedStrands> decode_usc_data(std::span<const std::byte> bytes);
Result<ImportedStrands> decode_strands(StrandFormat format, std::span<const std::byte> bytes);

}  // namespace hairnet
