#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/ffd/bspline.hpp"
#include "core/ffd/lattice.hpp"
#include "core/ffd/rest_tangents.hpp"
#include "core/ffd/wide_deform.hpp"
#include "core/groom/groom.hpp"

namespace hairnet {

// delta(lambda) of eq. 7, or of the group's own curve, for every point of the groom: 0 moves rigidly with the head, 1
// follows the lattice. It is 1 for hair without a root on the skull and for root_length_m = 0.
std::vector<float> root_blend(const Groom& groom);

// Deforms a fixed set of points by the displacements of the lattice's nodes. The points are given at rest in head space
// and sorted by stencil once, in the constructor; deform() writes results in the caller's order. deform() allocates
// nothing and several threads may call it at once. The bits of a point's result do not depend on the other points. It
// does not push points out of the skin (SkinPush) and does not limit lengths (StrandLengths).
class Deformer {
 public:
  // `blend`: delta of each point, or empty for 1. Points may lie outside the lattice (linear extrapolation).
  Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend, FfdKind kind);
  // Prepares for tangents too. `rest` has one entry per point.
  Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend,
           const RestTangents& rest, FfdKind kind);
  // All points of the groom: those of strands, threads, cards and cloths.
  Deformer(const Groom& groom, const Lattice& lattice, FfdKind kind);

  // points_out[i] = x_i + delta_i u(x_i), u(x) = sum_j w_j(x) displacement_j; head space, m. `grid_displacements` has
  // an entry for every grid node (expand_displacements makes it); `points_out` one for each point: both are asserted.
  void deform(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out) const;
  // Also writes tangents_out[i] = d(points_out)/ds, where s is the arc length at rest. With t the rest tangent and J
  // the gradient of u:
  //     t + delta J t + (d delta / ds) u.
  // The last term matters near the root, where delta rises. Tangents are not normalised: they are longer where hair is
  // stretched. Asserts that the Deformer was constructed with RestTangents.
  void deform(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out,
              std::span<Vec3f> tangents_out) const;

  [[nodiscard]] std::size_t point_count() const { return point_count_; }
  [[nodiscard]] bool has_tangents() const { return !slopes_[0].empty(); }

 private:
  Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend,
           const RestTangents* rest, FfdKind kind);
  [[nodiscard]] WideDeform make_work(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out) const;

  Lattice lattice_;
  FfdKind kind_;
  std::size_t point_count_;
  std::vector<DeformCell> cells_;
  // Sorted, with kDeformOverhang more entries, named as in WideDeform.
  std::vector<std::uint32_t> output_offsets_;
  std::array<std::vector<float>, 4> points_, slopes_;
};

}  // namespace hairnet
