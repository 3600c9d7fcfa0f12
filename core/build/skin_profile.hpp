#pragma once

#include <vector>

#include "core/geometry/mesh_query.hpp"

namespace hairnet {

// A ball reaches skin between these shares of its radius from its centre.
inline constexpr double kSkinRatioLeast = 0.5, kSkinRatioMost = 2;

// How far out of a ball's centre hair has to stay, by direction: the skin, or where it rises within kSkinCone_rad of
// the direction, that much farther, since hair slides. A cube map, read by bilinear interpolation.
class SkinProfile {
 public:
  SkinProfile() = default;  // without skin: never to be asked
  SkinProfile(const MeshQuery& skin, const Vec3& centre, double radius);

  // Metres. `direction` need not have unit length, but some.
  [[nodiscard]] double distance(const Vec3& direction) const;

 private:
  std::vector<float> distances_;  // [face][row][column]
};

}  // namespace hairnet
