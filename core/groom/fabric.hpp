#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/vec.hpp"

namespace hairnet {

// A run of Groom::points.
struct PointRange {
  std::uint32_t begin = 0, end = 0;
  [[nodiscard]] std::size_t count() const { return end - begin; }
};

// A thread, cord or chain: a line that resists stretching. Stiffness is limited by what the solver can handle at 25
// steps a second (all hair of a head adds up to 40 N); real yarn is stiffer.
struct Thread {
  PointRange points{};  // a polyline
  std::uint16_t group = 0;
  bool rooted = false;               // its first point is pinned to the skull
  float root_length_m = 0.02f;       // lambda_0 of eq. 7, if rooted
  float radius_m = 8e-4f;            // for drawing
  Vec3f colour{0.6f, 0.1f, 0.1f};    // linear RGB albedo
  float axial_stiffness_n = 0.5f;    // a spring of length L has k = this / L
  float damping_time_s = 0.008f;     // q / k
  float pin_stiffness_n_per_m = 20;  // of the attachment, if rooted
  float linear_density_kg_per_m = 5e-4f;
  float air_drag_ns_per_m2 = 5e-4f;  // q of the drag tensor (eq. 6)
};

// Woven cloth: a veil, a hair band, a ribbon. Threads of the weave run along its shorter edges; an edge that is the
// longest of both its triangles is the diagonal of a quad and gives shear alone. Bending is left to the lattice, whose
// cells are larger than cloth's folds.
struct Cloth {
  PointRange points{};
  std::uint16_t group = 0;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // indices into Groom::points, within `points`
  // One a point: the way along the cloth to where it is pinned to the skull, m; 0 is pinned. Empty: pinned nowhere.
  std::vector<float> root_distance_m;
  float root_length_m = 0.02f;           // lambda_0 of eq. 7, if pinned
  Vec3f colour{0.8f, 0.8f, 0.8f};        // linear RGB albedo
  float opacity = 1;                     // for drawing
  float stretch_stiffness_n_per_m = 30;  // tension by width and strain along the weave
  float shear_stiffness_n_per_m = 3;     // shear modulus by width of a square weave
  float damping_time_s = 0.008f;         // q / k
  float pin_stiffness_n_per_m = 20;      // of the attachment at each pinned point
  float area_density_kg_per_m2 = 0.04f;
  float air_drag_ns_per_m3 = 0.6f;  // resistance to moving across its own plane, by area
};

// Ties points together: the strands of a ponytail in its band, the crossings of a plait, a ribbon in the hair. The tied
// points keep their distances from each other and from the knot's own frame of four points. A knot may have mass. Ten
// times the default stiffness holds no better, and at 60 iterations of the solver it holds worse.
struct Knot {
  std::vector<std::uint32_t> points{};  // indices into Groom::points, at least two
  float stiffness_n_per_m = 300;        // of the whole knot against being pulled in two
  float damping_time_s = 0.010f;        // q / k
  float mass_kg = 0;                    // a bead or clasp, at the mean of its points
};

}  // namespace hairnet
