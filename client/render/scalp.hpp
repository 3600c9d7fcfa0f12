#pragma once

#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet::render {

// Where the roots of a groom grow on the skin: the skin there is drawn in the colour of the hair.
class Scalp {
 public:
  explicit Scalp(const Groom& groom);
  // How far a point belongs to the scalp, 0 ... 1: 1 where roots are as dense as usual on this groom, including
  // partings between rows of roots; it falls to 0 just outside the outermost roots. Head space, m.
  [[nodiscard]] float at(const Vec3f& position) const;

 private:
  [[nodiscard]] float density(const Vec3f& position) const;

  float reach_m_ = 0;
  float usual_ = 1;           // density where roots are
  std::vector<Vec3f> roots_;  // by their x
};

}  // namespace hairnet::render
