#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet {

// The strands that are drawn for a groom: its own, then the copies of its clumps, which need no FFD of their own. A
// copy keeps its place across its strand: a fixed offset in a frame that follows the strand without twisting.
// Immutable; threads may share it. It knows no skin: copies go where their strand goes.
class ClumpStrands {
 public:
  explicit ClumpStrands(const Groom& groom);

  // Offsets of all drawn strands in the points that follow() writes: first the groom's own strands, in the groom's
  // order.
  [[nodiscard]] std::span<const std::uint32_t> strand_begin() const { return strand_begin_; }
  [[nodiscard]] std::size_t point_count() const { return strand_begin_.back(); }

  // `points`: of the groom, deformed, head space. The strands' own points are copied. Asserts that `points` has all of
  // them, and `points_out` point_count() entries.
  void follow(std::span<const Vec3f> points, std::span<Vec3f> points_out) const;

 private:
  struct Copy {
    // The copied strand has the groom's points from `begin` up to `end`, exclusive.
    std::uint32_t begin, end;
    // The angle about the strand, radians.
    float angle;
    // The share of the clump's radius, 0 … 1.
    float ring;
    // The clump's radii, near the root and at the tip.
    float radius_m, tip_radius_m;
  };
  std::size_t own_point_count_;
  std::vector<Copy> copies_;
  std::vector<std::uint32_t> strand_begin_;
};

}  // namespace hairnet
