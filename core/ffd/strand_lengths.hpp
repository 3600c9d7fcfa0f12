#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet {

// Limits deformed strands to their rest length. A lattice stretches in wild motion; real hair does not.
//
// Point i is moved to the arc length min(L_i, l_i) on its deformed polyline: L_i is the arc length of the deformed
// point, l_i that of the point at rest, both from the root. So a stretched strand follows its deformed curve and ends
// early. No point leaves the curve, so a strand that does not touch the skin still does not. A strand that is nowhere
// longer than at rest keeps its points; without deformation they keep their bits.
//
// The excess is taken from the whole length up to a point, not from each segment. Limiting each segment would also
// shorten strands that are pressed together at one place and drawn out at another, though their length is right, and
// would move all of their points beyond the first stretched segment.
class StrandLengths {
 public:
  // `points` are at rest. Strand s has the points from strand_begin[s] up to strand_begin[s + 1], exclusive.
  StrandLengths(std::span<const Vec3f> points, std::span<const std::uint32_t> strand_begin);
  explicit StrandLengths(const Groom& groom);

  // Moves the deformed `points` of the strands. Points after the last strand stay unchanged. Asserts that all are
  // there.
  void limit(std::span<Vec3f> points) const;

  // l_i, m: the arc length at rest from the root of the strand to each point.
  [[nodiscard]] std::span<const float> arc_m() const { return arc_m_; }

 private:
  std::vector<std::uint32_t> strand_begin_;
  std::vector<float> arc_m_;
};

}  // namespace hairnet
