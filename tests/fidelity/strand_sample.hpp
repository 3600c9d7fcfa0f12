#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/ffd/deform.hpp"
#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"

namespace hairnet::fidelity {

// Whole strands that represent a hairstyle; each part of it has its share.
struct StrandSample {
  // The points of the design, head space, m.
  std::vector<Vec3f> points;
  // One entry for each point.
  std::vector<float> blend;
  // Strand s has points [begin[s], begin[s + 1]).
  std::vector<std::uint32_t> begin{0};
  // One entry for each strand.
  std::vector<double> length_m;
  // Index `point_count` points or so, spread over the strands.
  std::vector<std::uint32_t> probe_points;

  [[nodiscard]] std::size_t strand_count() const { return length_m.size(); }
};
StrandSample sample_strands(const Groom& groom, std::size_t point_count);

double polyline_length(std::span<const Vec3f> points);

// The share of points where the lattice is turned inside out: det(dx/dX) < 0.
double inverted_share(const Level& level, const StrandSample& strands, std::span<const Vec3f> grid_displacements);

// Looks at the lower halves of strands, from middle to tip: the median of the angles to straight down, in radians.
double hanging_angle(const StrandSample& strands, std::span<const Vec3f> points_head, const Quat& head);

// The value that `share` of the values are not above; 0 when there are none. Reorders them.
double percentile(std::span<float> values, double share);

}  // namespace hairnet::fidelity
