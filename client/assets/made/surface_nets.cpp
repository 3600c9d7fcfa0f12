#include "client/assets/made/surface_nets.hpp"

#include <cmath>
#include <cstddef>
#include <limits>

namespace hairnet::made {
namespace {

// The grid's nodes are evaluated only near the surface, because the field is costly.
class SurfaceNet {
 public:
  SurfaceNet(const GridPlanes& planes, const std::function<double(const Vec3&)>& field) : planes_(planes) {
    for (std::size_t a = 0; a < 3; ++a) {
      dims_[a] = planes[a].size();
    }
    values_.assign(dims_[0] * dims_[1] * dims_[2], kUnknown);
    evaluate_near_surface(field);
    // The surface passes between no two nodes that are next to each other and unknown. So a node without a value has
    // the side of its left neighbour, and the first of a row is outside.
    each_node([&](const Node& n) {
      double& value = values_[index(n)];
      if (std::isnan(value)) value = n[0] == 0 ? 1 : std::copysign(1, values_[index(n) - 1]);
    });
  }

  TriangleMesh mesh() {
    place_vertices();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      join_quads(axis);
    }
    return std::move(mesh_);
  }

 private:
  using Node = std::array<std::size_t, 3>;
  static constexpr std::uint32_t kNone = ~0u;
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  [[nodiscard]] std::size_t index(const Node& n) const { return n[0] + dims_[0] * (n[1] + dims_[1] * n[2]); }
  [[nodiscard]] Vec3 position(const Node& n) const { return {planes_[0][n[0]], planes_[1][n[1]], planes_[2][n[2]]}; }
  [[nodiscard]] bool inside(const Node& n) const { return values_[index(n)] < 0; }

  template <class Visit>
  void each_node(const Visit& visit) {
    Node n;
    for (n[2] = 0; n[2] < dims_[2]; ++n[2]) {
      for (n[1] = 0; n[1] < dims_[1]; ++n[1]) {
        for (n[0] = 0; n[0] < dims_[0]; ++n[0]) {
          visit(n);
        }
      }
    }
  }

  // Asks for the field at the corners of the cells that the surface crosses, and of those beside them.
  void evaluate_near_surface(const std::function<double(const Vec3&)>& field) {
    // The walk begins on the line along the first axis, where the caller promises that it enters the surface.
    Node first{0, dims_[1] / 2, dims_[2] / 2};
    while (first[0] + 2 < dims_[0] && !(field(position({first[0] + 1, first[1], first[2]})) < 0)) ++first[0];
    // The cells that the walk has visited.
    std::vector<bool> is_known(values_.size());
    std::vector<Node> open{first};
    while (!open.empty()) {
      const Node cell = open.back();
      open.pop_back();
      // Every cell is opened once; the corners of neighbours are shared.
      if (is_known[index(cell)]) continue;
      is_known[index(cell)] = true;
      int inside_count = 0;
      for (std::size_t corner = 0; corner < 8; ++corner) {
        const Node n{cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)};
        double& value = values_[index(n)];
        if (std::isnan(value)) value = field(position(n));
        inside_count += value < 0;
      }
      // A cell that the surface does not cross ends the walk there.
      if (inside_count == 0 || inside_count == 8) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Node below = cell, above = cell;
        --below[axis], ++above[axis];
        if (cell[axis] > 0) open.push_back(below);
        if (above[axis] + 1 < dims_[axis]) open.push_back(above);
      }
    }
  }

  // A cell is named by its lowest node; its vertex is the mean of the points where its edges cross the surface. The
  // mean instead of the exact place makes smooth surfaces, at the cost of sharp edges, which a bust has none of.
  void place_vertices() {
    vertex_of_cell_.assign(values_.size(), kNone);
    each_node([&](const Node& n) {
      if (n[0] + 1 >= dims_[0] || n[1] + 1 >= dims_[1] || n[2] + 1 >= dims_[2]) {
        return;
      }
      Vec3 sum = Vec3::Zero();
      int crossings = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t side = 0; side < 4; ++side) {
          Node a = n;
          a[(axis + 1) % 3] += side & 1;
          a[(axis + 2) % 3] += side >> 1;
          Node b = a;
          ++b[axis];
          if (inside(a) == inside(b)) {
            continue;
          }
          const double va = values_[index(a)], vb = values_[index(b)];
          sum += position(a) + va / (va - vb) * (position(b) - position(a));
          ++crossings;
        }
      }
      if (crossings == 0) {
        return;
      }
      vertex_of_cell_[index(n)] = static_cast<std::uint32_t>(mesh_.vertices.size());
      mesh_.vertices.emplace_back((sum / crossings).cast<float>());
    });
  }

  // Each crossed edge along `axis` joins the vertices of the four cells around it. The quad's order follows the sign,
  // so that triangles face outwards.
  void join_quads(std::size_t axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    each_node([&](const Node& n) {
      // Edges on the border of the grid have fewer than four cells; the caller promises that the surface stays off it.
      if (n[axis] + 1 >= dims_[axis] || n[u] == 0 || n[v] == 0) {
        return;
      }
      Node ahead = n;
      ++ahead[axis];
      if (inside(n) == inside(ahead)) {
        return;
      }
      Node c00 = n, c10 = n, c01 = n;
      --c00[u], --c00[v], --c10[v], --c01[u];
      std::array<std::uint32_t, 4> quad{vertex_of_cell_[index(c00)], vertex_of_cell_[index(c10)],
                                        vertex_of_cell_[index(n)], vertex_of_cell_[index(c01)]};
      if (!inside(n)) {
        std::swap(quad[1], quad[3]);
      }
      add_quad(quad);
    });
  }

  // The shorter diagonal gives the better pair of triangles.
  void add_quad(const std::array<std::uint32_t, 4>& q) {
    const auto length = [&](int i, int j) { return (mesh_.vertices[q[i]] - mesh_.vertices[q[j]]).squaredNorm(); };
    if (length(0, 2) <= length(1, 3)) {
      mesh_.triangles.push_back({q[0], q[1], q[2]});
      mesh_.triangles.push_back({q[0], q[2], q[3]});
    } else {
      mesh_.triangles.push_back({q[0], q[1], q[3]});
      mesh_.triangles.push_back({q[1], q[2], q[3]});
    }
  }

  const GridPlanes& planes_;
  Node dims_{};
  std::vector<double> values_;
  // The index of each cell's vertex; kNone: the surface does not cross the cell.
  std::vector<std::uint32_t> vertex_of_cell_;
  TriangleMesh mesh_;
};

}  // namespace

TriangleMesh polygonise(const GridPlanes& planes, const std::function<double(const Vec3&)>& field) {
  return SurfaceNet(planes, field).mesh();
}

}  // namespace hairnet::made
