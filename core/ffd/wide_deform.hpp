#pragma once

#include <cstddef>
#include <cstdint>

#include "core/ffd/bspline.hpp"

namespace hairnet {

// The kernel may read this many entries past the end of each array: a vector can extend past the last entry. Such
// entries repeat the last point, so what they compute is written over with the same numbers.
inline constexpr std::size_t kDeformOverhang = 64;

// The points of one stencil, which are consecutive in the sorted arrays.
struct DeformCell {
  // The cell has the sorted points from `begin` up to `end`, exclusive.
  std::uint32_t begin, end;
  // The grid index of the lowest node of the stencil.
  std::uint32_t base;
  // Whether the border nodes extrapolate; either for all points of the cell or for none.
  bool outside;
  // The node from which t counts: its position in head space over the spacing.
  float centre[3];
};

// The arguments of a kernel; it owns none of them. Only plain pointers: the kernel is compiled for several instruction
// sets and must not share an inline function with other translation units.
struct WideDeform {
  const DeformCell* cells;
  std::size_t cell_count;
  // The x, y and z of each point at rest, and its root blend delta, in sorted order.
  const float* points[4];
  // The rest tangent of each point and d delta / ds, in sorted order; null without tangents_out.
  const float* slopes[4];
  // For each sorted point, the index of the first of its floats in points_out.
  const std::uint32_t* output_offsets;
  float inverse_spacing[3];  // 1/m
  // The number of grid nodes in a row along x, in a slice of one z, and in all.
  std::uint32_t row, slice, node_count;
  // The displacement xyz of every grid node.
  const float* displacements;
  // The results xyz of every point, in the caller's order.
  float* points_out;
  // The tangents xyz of every point, or null.
  float* tangents_out;
};

// Runs the kernel of the best instruction set of this machine, or the best that hwy::SetSupportedTargetsForTest allows.
void wide_deform(FfdKind kind, const WideDeform& work);

}  // namespace hairnet
