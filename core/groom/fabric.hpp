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
  // Is a polyline.
  PointRange points{};
  std::uint16_t group = 0;
  // Its first point is pinned to the skull.
  bool rooted = false;
  // Is lambda_0 of eq. 7, if rooted.
  float root_length_m = 0.02f;
  // Drawing alone uses it.
  float radius_m = 8e-4f;
  // Is a linear RGB albedo.
  Vec3f colour{0.6f, 0.1f, 0.1f};
  // A spring of length L has k = this / L.
  float axial_stiffness_n = 0.5f;
  float damping_time_s = 0.008f;  // q / k
  // Applies to the attachment, if rooted.
  float pin_stiffness_n_per_m = 20;
  float linear_density_kg_per_m = 5e-4f;
  // Is q of the drag tensor (eq. 6).
  float air_drag_ns_per_m2 = 5e-4f;
};

// Woven cloth: a veil, a hair band, a ribbon. Threads of the weave run along its shorter edges; an edge that is the
// longest of both its triangles is the diagonal of a quad and only resists shear. The lattice alone resists bending,
// because its cells are larger than the folds of cloth.
struct Cloth {
  PointRange points{};
  std::uint16_t group = 0;
  // Has indices into Groom::points, within `points`.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  // One entry for each point: the distance along the cloth to the place where it is pinned to the skull, m; 0 is
  // pinned. Empty: not pinned.
  std::vector<float> root_distance_m;
  // Is lambda_0 of eq. 7, if pinned.
  float root_length_m = 0.02f;
  // Is a linear RGB albedo.
  Vec3f colour{0.8f, 0.8f, 0.8f};
  // Drawing alone uses it.
  float opacity = 1;
  // Is the tension over width and strain, along the weave.
  float stretch_stiffness_n_per_m = 30;
  // Is the shear modulus over width of a square weave.
  float shear_stiffness_n_per_m = 3;
  float damping_time_s = 0.008f;  // q / k
  // Applies to the attachment at each pinned point.
  float pin_stiffness_n_per_m = 20;
  float area_density_kg_per_m2 = 0.04f;
  // Is the resistance to motion across the cloth's plane, over area.
  float air_drag_ns_per_m3 = 0.6f;
};

// Ties points together: the strands of a ponytail in its band, the crossings of a plait, a ribbon in the hair. The tied
// points keep their distances from each other and from the knot's own frame of four points. A knot may have mass. Ten
// times the default stiffness ties no better, and at 60 iterations of the solver it ties worse.
struct Knot {
  // Are indices into Groom::points; there are at least two.
  std::vector<std::uint32_t> points{};
  // Acts on the whole knot against being pulled apart.
  float stiffness_n_per_m = 300;
  float damping_time_s = 0.010f;  // q / k
  // Is the mass of a bead or clasp, at the mean of its points.
  float mass_kg = 0;
};

}  // namespace hairnet
