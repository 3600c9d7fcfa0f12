#pragma once

#include <span>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet {

// How hair goes on at each point of it, by the arc length s at rest.
struct RestTangents {
  std::vector<Vec3f> direction;    // dx / ds, of unit length, head space
  std::vector<float> blend_slope;  // d delta / ds, 1/m
};

// Of all points of the groom: along strands, threads and the middle of strips, differences between a point's
// neighbours, as the drawn polyline has them. Zero where no line leads: on cloths, and on lines of no length.
// `blend` is delta of each point (root_blend).
RestTangents rest_tangents(const Groom& groom, std::span<const float> blend);

// The same of far strips' points, along either edge. `blend` is that of far_strip_blend.
RestTangents far_strip_tangents(const FarStrips& far, std::span<const float> blend);
// Of unit length, one for either point of a pair: across (left to right) x along, which is away from the head.
std::vector<Vec3f> far_strip_normals(const FarStrips& far, const RestTangents& rest);

}  // namespace hairnet
