#pragma once

#include "client/draw/groom_geometry.hpp"
#include "client/draw/occlusion_grid.hpp"
#include "core/ffd/rest_tangents.hpp"

namespace hairnet::draw {

// The input of all parts of make_groom_geometry. `blend` is delta of eq. 7 for every groom point, `rest` the hair's
// direction at each of them.
struct GeometrySource {
  const Groom& groom;
  const OcclusionGrid& occlusion;
  std::span<const float> blend;
  const RestTangents& rest;
};
// Each part adds the vertices of one kind of thing. The order of the calls does not matter.
void add_strands(const GeometrySource& source, GroomGeometry& geometry);
void add_cards(const GeometrySource& source, GroomGeometry& geometry);
void add_fabric(const GeometrySource& source, GroomGeometry& geometry);
void add_body(const GeometrySource& source, GroomGeometry& geometry);

// Values beyond the range of a half are clamped to it, since infinity would spoil shading.
Half4 to_halves(const Vec3f& v, float w);
// `x` is clamped to 0 ... 1.
std::uint8_t to_byte(float x);
// Packs the transmittance from +x -x +y -y.
Byte4 sides_of(const Transmittance& left);
// Packs the transmittance from +z -z and two more shares.
Byte4 ends_of(const Transmittance& left, float third, float fourth);
// Returns +Y for a vector without a length, such as the normal of a degenerate triangle.
Vec3f unit_or_up(const Vec3f& v);

}  // namespace hairnet::draw
