#pragma once

#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet::view {

// Where the roots of a groom grow on the skin: the skin there is drawn in the colour of the hair.
class Scalp {
 public:
  explicit Scalp(const Groom& groom);
  // How much of a scalp a place is: 1 where roots stand as dense as they usually do on this groom, on partings between
  // rows of roots too; falls to 0 within reach of the outermost roots. Head space, m.
  [[nodiscard]] float at(const Vec3f& position) const;

 private:
  [[nodiscard]] float density(const Vec3f& position) const;

  float reach_m_ = 0;
  float usual_ = 1;           // density where roots are
  std::vector<Vec3f> roots_;  // by their x
};

}  // namespace hairnet::view
