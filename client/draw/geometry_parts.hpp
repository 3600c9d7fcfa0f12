#pragma once

#include "client/draw/groom_geometry.hpp"
#include "client/draw/occlusion_grid.hpp"
#include "core/ffd/rest_tangents.hpp"

namespace hairnet::draw {

// The input for the parts of make_groom_geometry. `blend`: delta of every groom point; `rest`: the hair's direction at
// each.
struct GeometrySource {
  const Groom& groom;
  const OcclusionGrid& occlusion;
  std::span<const float> blend;
  const RestTangents& rest;
};
void add_strands(const GeometrySource& source, GroomGeometry& geometry);
void add_cards(const GeometrySource& source, GroomGeometry& geometry);
void add_fabric(const GeometrySource& source, GroomGeometry& geometry);
void add_body(const GeometrySource& source, GroomGeometry& geometry);

Half4 to_halves(const Vec3f& v, float w);
std::uint8_t to_byte(float x);  // `x` in 0 ... 1
Byte4 sides_of(const Transmittance& left);
Byte4 ends_of(const Transmittance& left, float third, float fourth);
Vec3f unit_or_up(const Vec3f& v);

}  // namespace hairnet::draw
