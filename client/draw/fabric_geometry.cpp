#include "client/draw/geometry_parts.hpp"

namespace hairnet::draw {
namespace {

FabricVertex vertex(const GeometrySource& source, std::uint32_t point, const Vec3f& direction, const Vec3f& colour,
                    float opacity, float cord) {
  const Vec3f& p = source.groom.points[point];
  const Transmittance left = source.occlusion.at(p);
  return {{p.x(), p.y(), p.z(), source.blend[point]},
          to_halves(direction, source.rest.blend_slope[point]),
          sides_of(left),
          ends_of(left, 0, 0),
          {colour.x(), colour.y(), colour.z(), opacity},
          cord};
}

void add_cloth(const GeometrySource& source, const Cloth& cloth, Mesh<FabricVertex>& mesh) {
  // Vertices of all cloths share one mesh, so triangles are renumbered from the groom's points to the mesh.
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  std::vector<Vec3f> normals(cloth.points.count(), Vec3f::Zero());
  const auto& points = source.groom.points;
  for (const auto& [a, b, c] : cloth.triangles) {
    const Vec3f area = (points[b] - points[a]).cross(points[c] - points[a]);
    for (const std::uint32_t corner : {a, b, c}) {
      normals[corner - cloth.points.begin] += area;
      mesh.triangles.push_back(first + corner - cloth.points.begin);
    }
  }
  for (std::uint32_t p = cloth.points.begin; p < cloth.points.end; ++p) {
    mesh.vertices.push_back(
        vertex(source, p, unit_or_up(normals[p - cloth.points.begin]), cloth.colour, cloth.opacity, 0));
  }
}

void add_thread(const GeometrySource& source, const Thread& thread, Mesh<FabricVertex>& mesh) {
  for (std::uint32_t p = thread.points.begin; p < thread.points.end; ++p) {
    const auto here = static_cast<std::uint32_t>(mesh.vertices.size());
    // The shader moves both vertices by `cord` to the sides of the thread as the camera sees it.
    for (const float side : {-1.0f, 1.0f}) {
      mesh.vertices.push_back(vertex(source, p, source.rest.direction[p], thread.colour, 1, side * thread.radius_m));
    }
    if (p == thread.points.begin) continue;
    mesh.triangles.insert(mesh.triangles.end(), {here - 2, here - 1, here, here, here - 1, here + 1});
  }
}

}  // namespace

void add_fabric(const GeometrySource& source, GroomGeometry& geometry) {
  // A thread without a radius has mechanics, but is not drawn.
  for (const Thread& thread : source.groom.threads) {
    if (thread.radius_m > 0) add_thread(source, thread, geometry.fabric);
  }
  for (const Cloth& cloth : source.groom.cloths) add_cloth(source, cloth, geometry.fabric);
}

}  // namespace hairnet::draw
