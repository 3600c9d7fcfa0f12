#pragma once

#include <cstdint>
#include <vector>

#include "client/view/light_volume.hpp"

namespace hairnet::view {

// One vertex of a body, as body.vert reads it.
struct SurfaceVertex {
  std::array<float, 3> position;
  std::array<std::int16_t, 4> normal;  // xyz / 32767
  std::array<std::uint8_t, 4> around;  // light left of ambient, fill, rim; nearness of roots; / 255
};

struct BodySurface {
  std::vector<SurfaceVertex> vertices;
  std::vector<std::uint32_t> triangles;  // without those that touch a vertex that is not drawable
  Eigen::AlignedBox3f box;
};

BodySurface make_surface(const DrawnCharacter& character, const LightVolume& light);

}  // namespace hairnet::view
