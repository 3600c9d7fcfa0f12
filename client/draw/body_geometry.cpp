#include <cmath>

#include "client/draw/geometry_parts.hpp"
#include "client/draw/scalp.hpp"

namespace hairnet::draw {
namespace {

// Resting hair blocks light from the body, but this share of the blocked light reaches the skin all the same: a little
// on the head, by scattering, and most of it on back and shoulders, because the hair there moves away.
constexpr float kSwungAway = 0.6f, kScattered = 0.2f;

}  // namespace

void add_body(const GeometrySource& source, GroomGeometry& geometry) {
  const Body& body = source.groom.body;
  const Scalp scalp(source.groom);
  std::vector<Vec3f> normals(body.mesh.vertices.size(), Vec3f::Zero());
  for (const auto& [a, b, c] : body.mesh.triangles) {
    const Vec3f& p = body.mesh.vertices[a];
    // The length of the cross product is twice the triangle's area: so large triangles count more in a vertex's normal.
    const Vec3f area = (body.mesh.vertices[b] - p).cross(body.mesh.vertices[c] - p);
    for (const std::uint32_t corner : {a, b, c}) {
      normals[corner] += area;
      geometry.body.triangles.push_back(corner);
    }
  }
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vec3f& p = body.mesh.vertices[i];
    const Vec3f n = unit_or_up(normals[i]);
    const auto& share = body.bone_weights[i];
    // A point's own cell contains the skin itself: sample a little outside.
    Transmittance left = source.occlusion.at(p + 1.5f * source.occlusion.cell_m() * n, n);
    // Hair at rest always shades the head, softly; it shades back and shoulders only until it swings away.
    for (float& side : left) side = std::lerp(side, 1.0f, std::lerp(kSwungAway, kScattered, share[0]));
    geometry.body.vertices.push_back({{p.x(), p.y(), p.z()},
                                      to_halves(n, scalp.at(p)),
                                      sides_of(left),
                                      ends_of(left, share[4], 0),
                                      {to_byte(share[0]), to_byte(share[1]), to_byte(share[2]), to_byte(share[3])}});
  }
}

}  // namespace hairnet::draw
