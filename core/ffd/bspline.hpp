#pragma once

#include <array>
#include <cstdint>

#include "core/ffd/lattice.hpp"

namespace hairnet {

// How displacements are interpolated between nodes: by quadratic B-splines (paper 4), or linearly, which is faster
// and less smooth.
enum class FfdKind : std::uint8_t { quadratic, linear };

// The position of a point relative to the lattice nodes that move it.
struct FfdSite {
  // The grid index of the lowest node of the stencil: 3 x 3 x 3 nodes (quadratic) or 2 x 2 x 2 (linear).
  std::uint32_t base;
  // The position from the stencil's middle node (quadratic) or lowest node (linear), in node spacings.
  Vec3f t;
  // Whether the border nodes extrapolate linearly here: t is beyond [-1/2, 1/2] (quadratic) or [0, 1] (linear).
  bool outside;
};
FfdSite ffd_site(const Lattice& lattice, FfdKind kind, const Vec3f& point_head);

// The 27 nodes and weights that move one point by quadratic FFD (paper 4), grid indices.
struct FfdWeight {
  std::uint32_t node;
  float weight;
};
std::array<FfdWeight, 27> quadratic_ffd_weights(const Lattice& lattice, const Vec3f& point_head);

}  // namespace hairnet
