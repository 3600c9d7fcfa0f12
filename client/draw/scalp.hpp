#pragma once

#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet::draw {

// The area of the skin where the groom's roots grow. The skin there is drawn in the colour of the hair, so that
// partings show no bright streaks between strands. It copies the roots.
class Scalp {
 public:
  explicit Scalp(const Groom& groom);
  // The share of scalp at a point, 0 ... 1: 1 where roots are as dense as usual on this groom, including partings
  // between rows of roots; it falls to 0 just outside the outermost roots. Head space, m.
  [[nodiscard]] float at(const Vec3f& position) const;

 private:
  [[nodiscard]] float density(const Vec3f& position) const;

  // A root counts up to this distance.
  float reach_m_ = 0;
  // The median density at the roots, which other densities are compared with: grooms differ in their number of strands.
  float usual_ = 1;
  // Sorted by x, so that a search visits a slab of them instead of all.
  std::vector<Vec3f> roots_;
};

}  // namespace hairnet::draw
