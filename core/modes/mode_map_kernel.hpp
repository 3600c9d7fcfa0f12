#pragma once

#include <cstddef>

namespace hairnet {

// Characters that one call takes.
inline constexpr std::size_t kModeMapWidth = 16;

// Adds `rows` products of a matrix, [row][column] with `stride` numbers from row to row, to `sums`, [row][character];
// `numbers` is [column][character]. Both are aligned to 64 bytes. Compiled for several instruction sets; the first call
// picks the best one for the machine. A character's sums do not depend on the others.
void mode_map_kernel(const float* matrix, std::size_t stride, std::size_t rows, std::size_t columns,
                     const float* numbers, float* sums);

}  // namespace hairnet
