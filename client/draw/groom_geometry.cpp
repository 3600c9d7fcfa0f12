#include "client/draw/groom_geometry.hpp"

#include <algorithm>
#include <cmath>

#include "client/draw/geometry_parts.hpp"
#include "core/ffd/clump_strands.hpp"
#include "core/ffd/deform.hpp"

namespace hairnet::draw {
namespace {

// A strand has this width, 0.4 mm, when 10 000 strands are drawn. It is several times that of a real hair, since a
// strand stands for several.
constexpr float kWidth_m = 4e-4f, kWidthCount = 10'000;

// Fewer strands are drawn wider, so that a head looks covered at any density.
float strand_width_m(std::size_t strand_count) {
  return kWidth_m *
         std::clamp(std::sqrt(kWidthCount / static_cast<float>(std::max<std::size_t>(1, strand_count))), 0.6f, 4.0f);
}

float radius_of(const Groom& groom) {
  float squared = 0;
  // The centre of the ball is the head joint, the origin of head space.
  for (const Vec3f& p : groom.points) squared = std::max(squared, p.squaredNorm());
  for (const Vec3f& p : groom.body.mesh.vertices) squared = std::max(squared, p.squaredNorm());
  return std::sqrt(squared);
}

}  // namespace

Half4 to_halves(const Vec3f& v, float w) {
  // The largest half is 65504; a larger number would become infinite.
  const auto half = [](float x) { return Eigen::half(std::clamp(x, -6e4f, 6e4f)).x; };
  return {half(v.x()), half(v.y()), half(v.z()), half(w)};
}

std::uint8_t to_byte(float x) {
  return static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(x, 0.0f, 1.0f)));
}

Byte4 sides_of(const Transmittance& left) {
  return {to_byte(left[0]), to_byte(left[1]), to_byte(left[2]), to_byte(left[3])};
}

Byte4 ends_of(const Transmittance& left, float third, float fourth) {
  return {to_byte(left[4]), to_byte(left[5]), to_byte(third), to_byte(fourth)};
}

Vec3f unit_or_up(const Vec3f& v) {
  return v.squaredNorm() > 1e-24f ? Vec3f(v.normalized()) : Vec3f(Vec3f::UnitY());
}

std::optional<Groom> coarse_groom(const Groom& groom) {
  // Fewer strands, though drawn wider, would not cover a head.
  constexpr std::size_t kCoarseStrands = 500;
  // Grooms with fewer strands are made in a moment.
  constexpr std::size_t kCoarseFrom = 2000;
  if (groom.strand_count() < kCoarseFrom) return {};
  Groom coarse;
  coarse.name = groom.name;
  coarse.group_names = groom.group_names;
  coarse.materials = groom.materials;
  coarse.root_blends = groom.root_blends;
  coarse.body = groom.body;
  // Every step-th strand, so that the sample has strands of all groups and regions.
  const std::size_t step = groom.strand_count() / kCoarseStrands;
  for (std::size_t s = 0; s < groom.strand_count(); s += step)
    coarse.add_strand(groom.strand_points(s), groom.strands[s]);
  return coarse;
}

GroomGeometry make_groom_geometry(const Groom& groom) {
  GroomGeometry geometry;
  geometry.strand_count = ClumpStrands(groom).strand_begin().size() - 1;
  geometry.strand_width_m = strand_width_m(geometry.strand_count);
  const float drawn_per_strand =
      static_cast<float>(geometry.strand_count) / static_cast<float>(std::max<std::size_t>(1, groom.strand_count()));
  // Light must be traced with the width of all that is drawn: clumps add copies that the groom's own strands do not
  // count.
  const OcclusionGrid occlusion(groom, geometry.strand_width_m * kCopies * drawn_per_strand);
  const std::vector<float> blend = root_blend(groom);
  const RestTangents rest = rest_tangents(groom, blend);
  const GeometrySource source{groom, occlusion, blend, rest};
  add_strands(source, geometry);
  add_cards(source, geometry);
  add_fabric(source, geometry);
  add_body(source, geometry);
  geometry.radius_m = radius_of(groom);
  return geometry;
}

}  // namespace hairnet::draw
