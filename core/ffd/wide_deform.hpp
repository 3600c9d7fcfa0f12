#pragma once

#include <cstddef>
#include <cstdint>

#include "core/ffd/bspline.hpp"

namespace hairnet {

// The kernel may read this many entries past the end of each array: a vector can extend past the last entry. Such
// entries repeat the last point, so what they compute is written over with the same numbers.
inline constexpr std::size_t kDeformOverhang = 64;

// Points of one stencil, consecutive in the sorted arrays.
struct DeformCell {
  std::uint32_t begin, end;  // sorted points
  std::uint32_t base;        // grid index of the stencil's lowest node
  bool outside;              // the border nodes extrapolate for all of them, or for none
  float centre[3];           // the node from which t counts, head space over spacing
};

// The arguments of a kernel; it owns none of them. Only plain pointers: the kernel is compiled for several instruction
// sets and must not share an inline function with other translation units.
struct WideDeform {
  const DeformCell* cells;
  std::size_t cell_count;
  const float* points[4];                // sorted: x, y, z, delta
  const float* slopes[4];                // sorted: rest tangent and d delta / ds; null without tangents_out
  const std::uint32_t* output_offsets;   // sorted point -> the first of its floats in points_out
  float inverse_spacing[3];              // 1/m
  std::uint32_t row, slice, node_count;  // nodes of the grid: along x, of one z, all
  const float* displacements;            // xyz of every grid node
  float* points_out;                     // xyz of every point
  float* tangents_out;                   // xyz of every tangent, or null
};

// Runs the kernel of the best instruction set of this machine, or the best that hwy::SetSupportedTargetsForTest allows.
void wide_deform(FfdKind kind, const WideDeform& work);

}  // namespace hairnet
