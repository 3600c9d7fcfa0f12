#pragma once

#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet::draw {

// The area of the skin where the groom's roots grow. The skin there is drawn in the colour of the hair.
class Scalp {
 public:
  explicit Scalp(const Groom& groom);
  // The share of scalp at a point, 0 ... 1: 1 where roots are as dense as usual on this groom, including partings
  // between rows of roots; it falls to 0 just outside the outermost roots. Head space, m.
  [[nodiscard]] float at(const Vec3f& position) const;

 private:
  [[nodiscard]] float density(const Vec3f& position) const;

  float reach_m_ = 0;
  float usual_ = 1;           // usual density at the roots
  std::vector<Vec3f> roots_;  // sorted by x
};

}  // namespace hairnet::draw
