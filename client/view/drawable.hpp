#pragma once

#include <cmath>
#include <string>

#include "client/view/renderer.hpp"

namespace hairnet::view {

inline constexpr float kCoordinateMax_m = 1e4f;  // what lies further would cost all precision and is not drawn

inline bool drawable(const Vec3f& p) {
  // Written so that NaN fails.
  return std::abs(p.x()) <= kCoordinateMax_m && std::abs(p.y()) <= kCoordinateMax_m &&
         std::abs(p.z()) <= kCoordinateMax_m;
}

// Empty when offsets and triangles name only what is there and colours and width are sound; else one line.
std::string validate(const DrawnCharacter& character);

}  // namespace hairnet::view
