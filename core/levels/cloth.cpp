#include "core/levels/cloth.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/assert.hpp"
#include "core/levels/resample.hpp"

namespace hairnet {
namespace {

// A triangle of the cloth in head space, m.
struct Triangle {
  Triangle(std::span<const Vec3f> points, const std::array<std::uint32_t, 3>& v)
      : corners{points[v[0]].cast<double>(), points[v[1]].cast<double>(), points[v[2]].cast<double>()},
        area_vector(0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0])),
        area(area_vector.norm()) {}
  std::array<Vec3, 3> corners;
  Vec3 area_vector;
  double area;  // m^2
};

struct Edge {
  // The area of its triangles, m^2.
  double area = 0;
  // The edge is clearly the longest of every triangle to which it belongs, so it is the diagonal of a quad (Cloth in
  // fabric.hpp).
  bool is_longest = true;
  // The third corner of each triangle.
  std::vector<std::uint32_t> across;
};
using Edges = std::map<std::array<std::uint32_t, 2>, Edge>;

double edge_length(std::span<const Vec3f> points, std::uint32_t a, std::uint32_t b) {
  return (points[b] - points[a]).cast<double>().norm();
}

// All edges of the cloth. A map keeps them in the order of their points, so that the same cloth gives the same bits.
Edges edges_of(std::span<const Vec3f> points, const Cloth& cloth) {
  // A diagonal is longer than the other edges by this factor at least; an equilateral triangle has none.
  constexpr double kClearlyLonger = 1.1;
  Edges edges;
  for (const auto& triangle : cloth.triangles) {
    HAIRNET_VALIDATE(std::ranges::max(triangle) < points.size());
    const double area = Triangle(points, triangle).area;
    HAIRNET_ASSERT(area >= 0);
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t a = triangle[i], b = triangle[(i + 1) % 3], c = triangle[(i + 2) % 3];
      Edge& edge = edges[{std::min(a, b), std::max(a, b)}];
      edge.area += area;
      edge.across.push_back(c);
      // A diagonal is clearly the longest side of both of its triangles. One triangle that says otherwise is enough to
      // make it an edge of the weave.
      edge.is_longest = edge.is_longest && edge_length(points, a, b) > kClearlyLonger * edge_length(points, b, c) &&
                        edge_length(points, a, b) > kClearlyLonger * edge_length(points, c, a);
    }
  }
  return edges;
}

// Adds springs along a straight line through the cloth, which is cut at lattice planes like hair. `axial_n` is the
// line's axial stiffness, N.
void add_straight(const Grid& grid, const Vec3f& from, const Vec3f& to, double axial_n, double damping_time_s,
                  std::uint16_t group, StiffenerList& springs) {
  HAIRNET_ASSERT(axial_n >= 0);
  std::vector<Vec3> line, cuts;
  polyline_on_grid(grid, std::array{from, to}, line);
  if (line.size() < 2) return;
  cut_points(grid, line, cuts);
  for (std::size_t i = 1; i < cuts.size(); ++i) {
    const double length = std::max(grid.length(cuts[i] - cuts[i - 1]), piece_length_min(grid));
    add_spring(grid, cuts[i - 1], cuts[i], {axial_n / length, damping_time_s, group}, springs);
  }
}

// The height from which the cloth hangs: that of its highest pinned point or, without any, of its highest point.
double hanging_height(std::span<const Vec3f> points, const Cloth& cloth) {
  HAIRNET_ASSERT(cloth.points.begin < cloth.points.end);
  HAIRNET_ASSERT(cloth.points.end <= points.size());
  float pinned = -INFINITY, any = -INFINITY;
  for (std::uint32_t i = cloth.points.begin; i < cloth.points.end; ++i) {
    any = std::max(any, points[i].y());
    if (!cloth.root_distance_m.empty() && cloth.root_distance_m[i - cloth.points.begin] <= 0)
      pinned = std::max(pinned, points[i].y());
  }
  HAIRNET_ASSERT(std::isfinite(any));
  HAIRNET_ASSERT(pinned <= any);
  return pinned > -INFINITY ? pinned : any;
}

}  // namespace

void add_cloth(const Grid& grid, std::span<const Vec3f> points_head, const Cloth& cloth, std::uint16_t group,
               StiffenerList& springs, StiffenerList& attachments) {
  HAIRNET_ASSERT(cloth.points.begin <= cloth.points.end);
  HAIRNET_ASSERT(cloth.points.end <= points_head.size());
  HAIRNET_ASSERT(cloth.root_distance_m.empty() || cloth.root_distance_m.size() == cloth.points.count());
  const double stretch = cloth.stretch_stiffness_n_per_m,
               shear = 2 * static_cast<double>(cloth.shear_stiffness_n_per_m);
  const double damping_time_s = cloth.damping_time_s;
  // An edge stands for a strip of the cloth whose width is the triangles' area over the edge's length, so its axial
  // stiffness is modulus times width.
  const auto add = [&](std::uint32_t a, std::uint32_t b, double modulus, double area) {
    const double length = edge_length(points_head, a, b);
    if (length < kLengthMin) return;
    add_straight(grid, points_head[a], points_head[b], modulus * area / length, damping_time_s, group, springs);
  };
  for (const auto& [ends, edge] : edges_of(points_head, cloth)) {
    add(ends[0], ends[1], edge.is_longest ? shear : stretch, edge.area);
    // The other diagonal of the quad, which the mesh does not have. At the border of the cloth there is none.
    if (edge.is_longest && edge.across.size() == 2) add(edge.across[0], edge.across[1], shear, edge.area);
  }
  if (!(cloth.pin_stiffness_n_per_m > 0)) return;
  for (std::size_t i = 0; i < cloth.root_distance_m.size(); ++i) {
    if (cloth.root_distance_m[i] > 0) continue;
    add_attachment(grid, grid.from_head(points_head[cloth.points.begin + i]), cloth.pin_stiffness_n_per_m,
                   cloth.damping_time_s, group, attachments);
  }
}

void lump_cloth(const Grid& grid, std::span<const Vec3f> points_head, const Cloth& cloth, const Material& material,
                LumpedHair& lumped) {
  HAIRNET_ASSERT(lumped.mass.size() == grid.node_count());
  const double root_height = hanging_height(points_head, cloth);
  for (std::uint32_t i = cloth.points.begin; i < cloth.points.end; ++i) {
    for (const auto& [node, weight] : grid.weights(grid.from_head(points_head[i]))) lumped.touched[node] = true;
  }
  for (const auto& corners : cloth.triangles) {
    const Triangle triangle(points_head, corners);
    if (!(triangle.area > 0)) continue;
    const Vec3 n = triangle.area_vector / triangle.area;
    const std::array<double, 6> nn{n[0] * n[0], n[0] * n[1], n[0] * n[2], n[1] * n[1], n[1] * n[2], n[2] * n[2]};
    // Samples spread evenly, closer than a third of a cell: the weights are smooth within cells only.
    const double longest = std::max({(triangle.corners[1] - triangle.corners[0]).norm(),
                                     (triangle.corners[2] - triangle.corners[1]).norm(),
                                     (triangle.corners[0] - triangle.corners[2]).norm()});
    // The upper limit bounds the work for a triangle as large as a groom may have, which could otherwise take millions
    // of samples.
    const int split = std::clamp(static_cast<int>(std::ceil(3 * longest / grid.spacing().minCoeff())), 1, 64);
    const double area = triangle.area / (split * split);
    const auto add = [&](double u, double v) {
      const Vec3 at = (1 - u - v) * triangle.corners[0] + u * triangle.corners[1] + v * triangle.corners[2];
      for (const auto& [node, weight] : grid.weights(grid.from_head(at.cast<float>()))) {
        const double mass = static_cast<double>(cloth.area_density_kg_per_m2) * area * weight;
        const double below_root = root_height - grid.node_head(node).y();
        add_mass(node, mass, below_root, material, lumped);
        for (int c = 0; c < 6; ++c)
          lumped.drag[node][c] += static_cast<double>(cloth.air_drag_ns_per_m3) * area * weight * nn[c];
      }
    };
    // The centres of the small triangles, upright and upside down.
    for (int i = 0; i < split; ++i) {
      for (int j = 0; i + j < split; ++j) {
        add((i + 1.0 / 3) / split, (j + 1.0 / 3) / split);
        if (i + j + 1 < split) add((i + 2.0 / 3) / split, (j + 2.0 / 3) / split);
      }
    }
  }
}

}  // namespace hairnet
