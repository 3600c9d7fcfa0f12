#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <utility>

#include "client/assets/import/placement.hpp"
#include "client/assets/import/skull_fit.hpp"

namespace hairnet {
namespace {

// The top of a head is only skull down to here, above brows and ears. A hat or a bun within this depth may make the fit
// fail; then roots or a skeleton must give the joint.
constexpr double kCap_m = 0.10;
// The number of points over the cap that the ellipsoid is fitted to. It does not depend on the mesh, so a fine mesh
// costs no more time than a coarse one.
constexpr std::size_t kSampleCount = 3000;
// Outside of these radii the top is no human skull, or the unit is wrong.
constexpr double kRadiusMin_m = 0.06, kRadiusMax_m = 0.14;

// An icosahedron with each triangle split in four, three times over: 642 vertices on the unit sphere.
TriangleMesh unit_sphere() {
  const float g = (1 + std::sqrt(5.0f)) / 2;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (Vec3f& x : mesh.vertices) x.normalize();
  for (int round = 0; round < 3; ++round) {
    // Each edge belongs to two triangles, which share the vertex at its middle.
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> halves;
    const auto half = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] = halves.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      return at->second;
    };
    std::vector<std::array<std::uint32_t, 3>> split;
    split.reserve(4 * mesh.triangles.size());
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = half(a, b), bc = half(b, c), ca = half(c, a);
      split.insert(split.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(split);
  }
  return mesh;
}

// Points spread evenly over the part of a mesh above `low_m`, from the low-discrepancy sequence of the plastic number.
std::vector<Vec3> surface_points(const TriangleMesh& mesh, double low_m) {
  const auto corner = [&](std::uint32_t v) -> Vec3 { return mesh.vertices[v].cast<double>(); };
  std::vector<std::array<std::uint32_t, 3>> triangles;
  // Sums up twice the areas of the triangles up to each one. The factor does not matter, since only shares count.
  std::vector<double> area{0};
  for (const auto& triangle : mesh.triangles) {
    const Vec3 a = corner(triangle[0]), b = corner(triangle[1]), c = corner(triangle[2]);
    if (std::max({a.y(), b.y(), c.y()}) < low_m) continue;
    triangles.push_back(triangle);
    area.push_back(area.back() + (b - a).cross(c - a).norm());
  }
  std::vector<Vec3> points;
  if (!(area.back() > 0) || !std::isfinite(area.back())) return points;
  std::size_t at = 0;
  for (std::size_t i = 0; i < kSampleCount; ++i) {
    // The wanted area ascends, so one walk through the triangles serves all points.
    const double wanted = area.back() * (static_cast<double>(i) + 0.5) / static_cast<double>(kSampleCount);
    while (area[at + 1] < wanted) ++at;
    const auto n = static_cast<double>(i + 1);
    // Both factors are powers of the inverse plastic number.
    double u = std::fmod(n * 0.7548776662466927, 1), v = std::fmod(n * 0.5698402909980532, 1);
    // Two numbers of a square give a point of a parallelogram; its far half is mirrored into the triangle.
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Vec3 a = corner(triangles[at][0]);
    const Vec3 point = a + u * (corner(triangles[at][1]) - a) + v * (corner(triangles[at][2]) - a);
    if (point.y() >= low_m) points.push_back(point);
  }
  return points;
}

}  // namespace

std::optional<SkullFit> skull_of_mesh(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return {};
  // The top is that of the triangles: files may have loose vertices above the head.
  double top = mesh.vertices[mesh.triangles.front()[0]].y();
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) top = std::max(top, static_cast<double>(mesh.vertices[v].y()));
  }
  SkullFit skull = fit_skull_shape(surface_points(mesh, top - kCap_m));
  const double radius = skull.radius();
  if (!skull.is_determined() || radius < kRadiusMin_m || radius > kRadiusMax_m) return {};
  return skull;
}

Body skull_body(const SkullFit& skull) {
  Body body;
  body.mesh = unit_sphere();
  for (Vec3f& x : body.mesh.vertices) x = (skull.centre + skull.semi_axes.cwiseProduct(x.cast<double>())).cast<float>();
  body.bone_weights.assign(body.mesh.vertices.size(), {1, 0, 0, 0, 0});
  body.fitted_from_roots = true;
  return body;
}

}  // namespace hairnet
