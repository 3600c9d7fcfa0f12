#pragma once

#include <span>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet {

// The derivatives along the hair at each point, by the arc length s at rest.
struct RestTangents {
  // The derivative dx / ds of each point, of unit length, head space.
  std::vector<Vec3f> direction;
  // The derivative d delta / ds of each point's root blend, 1/m.
  std::vector<float> blend_slope;
};

// Computes them for all points of the groom: central differences along strands, threads and the middle line of cards,
// so they match the drawn polyline. Zero for points of cloth and of lines without length. `blend`: delta of each point.
RestTangents rest_tangents(const Groom& groom, std::span<const float> blend);

}  // namespace hairnet
