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

// delta(lambda) of eq. 7, or of the group's own curve, for every groom point: 0 = moves rigidly with the head, 1 =
// follows the lattice. 1 throughout what has no root on the skull, or root_length_m = 0.
std::vector<float> root_blend(const Groom& groom);
// The same for every point of Groom::far_strips, along the middle of each.
std::vector<float> far_strip_blend(const Groom& groom);

// Deforms a fixed set of points, given at rest in head space, by displacements of the lattice's nodes. Points are
// sorted by stencil once, here; what deform() writes is in the caller's order. It allocates nothing, and several
// threads may call it at once. A point's bits depend on that point and the lattice alone, not on what points it is
// among.
class Deformer {
 public:
  // `blend`: delta of each point, or empty for 1. Points may lie outside the lattice (linear extrapolation).
  Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend, FfdKind kind);
  // Gives tangents too. `rest` has an entry for each point.
  Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend,
           const RestTangents& rest, FfdKind kind);
  // All points of the groom: strands', threads', strips' and cloths' alike.
  Deformer(const Groom& groom, const Lattice& lattice, FfdKind kind);

  // points_out[i] = x_i + delta_i u(x_i), u(x) = sum_j w_j(x) displacement_j; head space, m. `grid_displacements` has
  // an entry for every grid node (expand_displacements makes it); `points_out` one for each point.
  void deform(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out) const;
  // And tangents_out[i] = d(points_out)/ds, s the arc length at rest: with t the rest tangent and J the gradient of u,
  //     t + delta J t + (d delta / ds) u.
  // The last term is as large as the others near the root, where delta rises. Not of unit length: where hair is drawn
  // out, tangents are longer. Needs RestTangents at construction.
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
  // Sorted, with kDeformOverhang more entries, as WideDeform names them.
  std::vector<std::uint32_t> places_;
  std::array<std::vector<float>, 4> points_, slopes_;
};

}  // namespace hairnet
