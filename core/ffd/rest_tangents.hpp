#pragma once

#include <span>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet {

// The derivatives along the hair at each point, by the arc length s at rest.
struct RestTangents {
  std::vector<Vec3f> direction;    // dx / ds, of unit length, head space
  std::vector<float> blend_slope;  // d delta / ds, 1/m
};

// Computes them for all points of the groom: central differences along strands, threads and the middle line of cards,
// so they match the drawn polyline. Zero for points of cloth and of lines without length. `blend`: delta of each point.
RestTangents rest_tangents(const Groom& groom, std::span<const float> blend);

}  // namespace hairnet
