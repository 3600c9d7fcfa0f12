#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/vec.hpp"

namespace hairnet {

// A run of Groom::points. Its end is exclusive.
struct PointRange {
  std::uint32_t begin = 0, end = 0;
  [[nodiscard]] std::size_t count() const { return end - begin; }
};

// A thread, cord or chain: a line that resists stretching. Its stiffness is limited by what the solver can solve at 25
// steps a second (all hair of a head together has 40 N); real yarn is stiffer.
struct Thread {
  // The thread's polyline.
  PointRange points{};
  std::uint16_t group = 0;
  // Its first point is pinned to the skull.
  bool rooted = false;
  // The root length lambda_0 of eq. 7, for a rooted thread.
  float root_length_m = 0.02f;
  // The radius of the thread, for drawing alone.
  float radius_m = 8e-4f;
  // The linear RGB albedo.
  Vec3f colour{0.6f, 0.1f, 0.1f};
  // A spring of length L has k = this / L.
  float axial_stiffness_n = 0.5f;
  // The damping over the stiffness, q / k.
  float damping_time_s = 0.008f;
  // The stiffness of the attachment of a rooted thread.
  float pin_stiffness_n_per_m = 20;
  float linear_density_kg_per_m = 5e-4f;
  // The drag coefficient q of eq. 6.
  float air_drag_ns_per_m2 = 5e-4f;
};

// Woven cloth: a veil, a hair band, a ribbon. Threads of the weave run along its shorter edges; an edge that is the
// longest of both its triangles is the diagonal of a quad and only resists shear. The lattice alone resists bending,
// because its cells are larger than the folds of cloth.
struct Cloth {
  PointRange points{};
  std::uint16_t group = 0;
  // The corners of each triangle as indices into Groom::points, within `points`.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  // One entry for each point: the distance along the cloth to the place where it is pinned to the skull, m; 0 is
  // pinned. Empty: not pinned.
  std::vector<float> root_distance_m;
  // The root length lambda_0 of eq. 7, for pinned cloth.
  float root_length_m = 0.02f;
  // The linear RGB albedo.
  Vec3f colour{0.8f, 0.8f, 0.8f};
  // The opacity, for drawing alone.
  float opacity = 1;
  // The tension over width and strain, along the weave.
  float stretch_stiffness_n_per_m = 30;
  // The shear modulus over width of a square weave.
  float shear_stiffness_n_per_m = 3;
  // The damping over the stiffness, q / k.
  float damping_time_s = 0.008f;
  // The stiffness of the attachment at each pinned point.
  float pin_stiffness_n_per_m = 20;
  float area_density_kg_per_m2 = 0.04f;
  // The resistance to motion across the cloth's plane, over area.
  float air_drag_ns_per_m3 = 0.6f;
};

// Ties points together: the strands of a ponytail in its band, the crossings of a plait, a ribbon in the hair. The tied
// points keep their distances from each other and from the knot's own frame of four points. A knot may have mass. Ten
// times the default stiffness ties no better, and at 60 iterations of the solver it ties worse.
struct Knot {
  // The tied points, at least two, as indices into Groom::points.
  std::vector<std::uint32_t> points{};
  // The stiffness of the whole knot against being pulled apart.
  float stiffness_n_per_m = 300;
  // The damping over the stiffness, q / k.
  float damping_time_s = 0.010f;
  // The mass of a bead or clasp, which lies at the mean of the points.
  float mass_kg = 0;
};

}  // namespace hairnet
