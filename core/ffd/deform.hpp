#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/groom/groom.hpp"

namespace hairnet {

enum class FfdKind : std::uint8_t { quadratic, linear };

// delta(lambda) of eq. 7 for every groom point: 0 = moves rigidly with the head, 1 = follows the lattice. 1 throughout
// a strand with no root on the skull, or with root_length_m = 0.
std::vector<float> root_blend(const Groom& groom);

// The 27 nodes and weights that move one point by quadratic FFD (model section 7), grid indices.
struct FfdWeight {
  std::uint32_t node;
  float weight;
};
std::array<FfdWeight, 27> quadratic_ffd_weights(const Lattice& lattice, const Vec3f& point_head);

// Deforms a fixed set of points, given at rest in head space, by displacements of the lattice's nodes.
class Deformer {
 public:
  // Where a point is in the lattice.
  struct Site {
    std::uint32_t base;  // grid index of the lowest node of the stencil
    Vec3f t;             // from the stencil's middle node (quadratic) or lowest (linear), in node spacings
  };

  // `blend`: delta of each point, or empty for 1. Points may lie outside the lattice (linear extrapolation).
  Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend, FfdKind kind);
  Deformer(const Groom& groom, const Lattice& lattice, FfdKind kind);

  // points_out[i] = x_i + delta_i sum_j w_j(x_i) displacement_j, head space, m. `grid_displacements` has an entry for
  // every grid node (expand_displacements makes it); `points_out` one for each point.
  void deform(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out) const;

 private:
  Lattice lattice_;
  FfdKind kind_;
  std::vector<Vec3f> points_;
  std::vector<float> blend_;
  std::vector<Site> sites_;
};

}  // namespace hairnet
