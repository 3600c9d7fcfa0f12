#pragma once

#include <vector>

#include "core/build/body_balls.hpp"

namespace hairnet {

// How far the skin is from a ball's centre in every direction: what the ball has to stand for where hair comes from
// there. A cube map, read by bilinear interpolation.
class SkinProfile {
 public:
  SkinProfile(const MeshQuery& skin, const BodyBall& ball);

  // Metres; `direction` need not have unit length, but some. The skin itself, or a little farther out where it rises
  // beside the direction (see cone).
  [[nodiscard]] double distance(const Vec3& direction) const;

 private:
  void widen();

  std::vector<float> distances_;  // [face][row][column]
};

}  // namespace hairnet
