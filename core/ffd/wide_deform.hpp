#pragma once

#include <cstddef>
#include <cstdint>

#include "core/ffd/bspline.hpp"

namespace hairnet {

// Arrays that the kernel reads are readable so many entries beyond their last one: a vector may hang over.
inline constexpr std::size_t kDeformOverhang = 64;

// Points of one stencil, consecutive in the sorted arrays.
struct DeformCell {
  std::uint32_t begin, end;  // sorted points
  std::uint32_t base;        // grid index of the stencil's lowest node
  bool outside;              // all of them lie where the border nodes extrapolate, or none does
  float centre[3];           // the node that t counts from, head space over spacing
};

// What a kernel needs, borrowed. Plain pointers, for the kernel's code is compiled for several instruction sets and
// must share no inline function with the rest.
struct WideDeform {
  const DeformCell* cells;
  std::size_t cell_count;
  const float* points[4];                // sorted: x, y, z, delta
  const float* slopes[4];                // sorted: rest tangent and d delta / ds; null without tangents_out
  const std::uint32_t* order;            // sorted point -> point
  float inverse_spacing[3];              // 1/m
  std::uint32_t row, slice, node_count;  // nodes of the grid: along x, of one z, all
  const float* displacements;            // xyz of every grid node
  float* points_out;                     // xyz of every point
  float* tangents_out;                   // likewise, or null
};

// By the widest instruction set that this machine has, or that hwy::SetSupportedTargetsForTest leaves.
void wide_deform(FfdKind kind, const WideDeform& work);

}  // namespace hairnet
