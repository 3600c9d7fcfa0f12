#include "client/view/fabric_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>

#include "client/view/drawable.hpp"

namespace hairnet::view {
namespace {

constexpr std::uint32_t kSidesOfThread = 6;

template <class Integer>
Integer to_integer(float x) {
  constexpr float kMost = std::numeric_limits<Integer>::max();
  return static_cast<Integer>(std::lround(kMost * std::clamp(x, std::is_signed_v<Integer> ? -1.0f : 0.0f, 1.0f)));
}

Vec3f unit_or_up(const Vec3f& v) {
  return v.squaredNorm() > 1e-24f ? Vec3f(v.normalized()) : Vec3f(Vec3f::UnitY());
}

class FabricBuilder {
 public:
  FabricBuilder(const LightVolume& light, FabricMesh& mesh) : light_(light), mesh_(mesh) {}

  void add_cloth(const DrawnSurface& cloth) {
    std::vector<Vec3f> normals(cloth.points.size(), Vec3f::Zero());
    begin();
    for (const auto& corners : cloth.triangles) {
      const std::uint32_t a = corners[0] - cloth.first_index, b = corners[1] - cloth.first_index,
                          c = corners[2] - cloth.first_index;
      if (!drawable(cloth.points[a]) || !drawable(cloth.points[b]) || !drawable(cloth.points[c])) continue;
      const Vec3f area = (cloth.points[b] - cloth.points[a]).cross(cloth.points[c] - cloth.points[a]);
      for (const std::uint32_t corner : {a, b, c}) normals[corner] += area;
      add_triangle(a, b, c);
    }
    for (std::size_t i = 0; i < cloth.points.size(); ++i)
      add_vertex(cloth, cloth.points[i], normals[i], Vec3f::Zero(), 0, 0);
  }

  void add_strip(const DrawnSurface& strip, const Vec3f& hair_colour) {
    DrawnSurface hair = strip;
    hair.colour = hair_colour;
    hair.opacity = 1;
    begin();
    const std::size_t pairs = strip.points.size() / 2;
    const auto at = [&](std::size_t pair, std::size_t side) { return strip.points[2 * pair + side]; };
    for (std::size_t i = 0; i < pairs; ++i) {
      const std::size_t before = i > 0 ? i - 1 : i, after = std::min(i + 1, pairs - 1);
      const Vec3f along = at(after, 0) + at(after, 1) - at(before, 0) - at(before, 1);
      const Vec3f across = at(i, 1) - at(i, 0);
      for (const std::size_t side : {0u, 1u})
        add_vertex(hair, at(i, side), across.cross(along), unit_or_up(along), static_cast<float>(side),
                   static_cast<float>(i) / static_cast<float>(std::max<std::size_t>(pairs - 1, 1)));
      if (i + 1 < pairs && drawable(at(i, 0)) && drawable(at(i, 1)) && drawable(at(i + 1, 0)) &&
          drawable(at(i + 1, 1))) {
        const auto left = static_cast<std::uint32_t>(2 * i);
        add_triangle(left, left + 1, left + 2);
        add_triangle(left + 2, left + 1, left + 3);
      }
    }
  }

  // A tube about the line.
  void add_thread(const DrawnSurface& thread) {
    begin();
    Vec3f side = Vec3f::UnitX();
    const auto& line = thread.points;
    for (std::uint32_t i = 0; i < line.size(); ++i) {
      const Vec3f along = unit_or_up(line[std::min<std::size_t>(i + 1, line.size() - 1)] - line[i > 0 ? i - 1 : i]);
      const Vec3f flat = side - side.dot(along) * along;
      side = flat.squaredNorm() > 1e-8f ? Vec3f(flat.normalized()) : along.unitOrthogonal();
      const Vec3f other = along.cross(side);
      for (std::uint32_t k = 0; k < kSidesOfThread; ++k) {
        const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kSidesOfThread;
        const Vec3f out = std::cos(angle) * side + std::sin(angle) * other;
        add_vertex(thread, line[i] + thread.radius_m * out, out, Vec3f::Zero(), 0, 0);
        if (i == 0 || !drawable(line[i]) || !drawable(line[i - 1])) continue;
        const std::uint32_t here = i * kSidesOfThread, before = here - kSidesOfThread, next = (k + 1) % kSidesOfThread;
        add_triangle(before + k, before + next, here + k);
        add_triangle(here + k, before + next, here + next);
      }
    }
  }

 private:
  // Indices of triangles count from the next vertex on.
  void begin() {
    first_ = static_cast<std::uint32_t>(mesh_.vertices.size());
    ++number_;
  }
  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh_.triangles.insert(mesh_.triangles.end(), {first_ + a, first_ + b, first_ + c});
  }
  void add_vertex(const DrawnSurface& surface, const Vec3f& p, const Vec3f& normal, const Vec3f& fibre, float across,
                  float along) {
    const bool fine = drawable(p);
    const Vec3f at = fine ? p : Vec3f(Vec3f::Zero()), n = unit_or_up(fine ? normal : Vec3f(Vec3f::Zero()));
    const LightVolume::Left left = light_.at(at);
    mesh_.vertices.push_back(
        {{at.x(), at.y(), at.z()},
         {to_integer<std::int16_t>(n.x()), to_integer<std::int16_t>(n.y()), to_integer<std::int16_t>(n.z()), 0},
         {to_integer<std::int8_t>(fibre.x()), to_integer<std::int8_t>(fibre.y()), to_integer<std::int8_t>(fibre.z()),
          0},
         {to_integer<std::uint8_t>(left.ambient), to_integer<std::uint8_t>(left.fill),
          to_integer<std::uint8_t>(left.rim), 0},
         {surface.colour.x(), surface.colour.y(), surface.colour.z(), surface.opacity},
         {across, along, number_}});
    if (fine) mesh_.box.extend(at);
  }

  const LightVolume& light_;
  FabricMesh& mesh_;
  std::uint32_t first_ = 0;
  float number_ = 0;
};

bool is_opaque(const DrawnSurface& surface) {
  return surface.kind != DrawnSurface::Kind::cloth || surface.opacity >= 1;
}

}  // namespace

FabricMesh make_fabric(const DrawnCharacter& character, const LightVolume& light) {
  FabricMesh mesh;
  FabricBuilder builder(light, mesh);
  for (const bool opaque : {true, false}) {
    for (const DrawnSurface& surface : character.surfaces) {
      if (is_opaque(surface) != opaque) continue;
      switch (surface.kind) {
        case DrawnSurface::Kind::cloth:
          builder.add_cloth(surface);
          break;
        case DrawnSurface::Kind::strip:
          builder.add_strip(surface, character.hair_colour);
          break;
        case DrawnSurface::Kind::thread:
          builder.add_thread(surface);
          break;
      }
    }
    if (opaque) mesh.opaque_index_count = mesh.triangles.size();
  }
  return mesh;
}

}  // namespace hairnet::view
