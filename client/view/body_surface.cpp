#include "client/view/body_surface.hpp"

#include <algorithm>
#include <cmath>

#include "client/view/drawable.hpp"

namespace hairnet::view {
namespace {

std::uint8_t to_byte(float x) {
  return static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(x, 0.0f, 1.0f)));
}

SurfaceVertex make_vertex(const Vec3f& p, const Vec3f& weighted_normal, const LightVolume& light) {
  const Vec3f n = weighted_normal.squaredNorm() > 1e-24f ? Vec3f(weighted_normal.normalized()) : Vec3f(Vec3f::UnitY());
  const auto part = [](float x) {
    return static_cast<std::int16_t>(std::lround(32767.0f * std::clamp(x, -1.0f, 1.0f)));
  };
  // Its own cell holds the skin itself: look from a little outside.
  const LightVolume::Left left = light.at(p + 1.5f * light.cell_m() * n);
  const LightVolume::Left on_skin = light.at(p);
  return {{p.x(), p.y(), p.z()},
          {part(n.x()), part(n.y()), part(n.z()), 0},
          {to_byte(left.ambient), to_byte(left.fill), to_byte(left.rim), to_byte(on_skin.roots)}};
}

}  // namespace

BodySurface make_surface(const DrawnCharacter& character, const LightVolume& light) {
  BodySurface surface;
  if (character.triangles == nullptr) return surface;
  const auto& points = character.body_vertices;
  std::vector<Vec3f> normals(points.size(), Vec3f::Zero());
  surface.triangles.reserve(3 * character.triangles->size());
  for (const auto& triangle : *character.triangles) {
    const auto [a, b, c] = triangle;
    if (!drawable(points[a]) || !drawable(points[b]) || !drawable(points[c])) continue;
    const Vec3f area = (points[b] - points[a]).cross(points[c] - points[a]);
    for (const std::uint32_t corner : triangle) {
      normals[corner] += area;
      surface.triangles.push_back(corner);
      surface.box.extend(points[corner]);
    }
  }
  surface.vertices.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool fine = drawable(points[i]);
    surface.vertices.push_back(make_vertex(fine ? points[i] : Vec3f(Vec3f::Zero()), normals[i], light));
  }
  return surface;
}

}  // namespace hairnet::view
