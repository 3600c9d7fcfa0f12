#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"

namespace hairnet {

// Nearest point, first ray hit and inside test on a fixed mesh, with a bounding volume hierarchy. The mesh may be open,
// may have inner shells and degenerate triangles. Copies the triangles; queries are const and may run on many threads.
class MeshQuery {
 public:
  // Asserts that every triangle's indices are in range. Every vertex must be finite.
  explicit MeshQuery(const TriangleMesh& mesh);

  [[nodiscard]] bool empty() const { return corners_.empty(); }

  struct Closest {
    std::uint32_t triangle = 0;
    // The distance, m; infinite when the mesh is empty.
    double distance = std::numeric_limits<double>::infinity();
    Vec3 point = Vec3::Zero();
    // The weights of the triangle's three corners in the point; their sum is 1.
    Vec3 barycentric = Vec3::Zero();
  };
  // The nearest point within `distance_max`; an infinite distance means that there is none.
  [[nodiscard]] Closest closest(const Vec3& point, double distance_max = std::numeric_limits<double>::infinity()) const;

  struct Hit {
    std::uint32_t triangle = 0;
    // The distance along the ray, m.
    double distance = 0;
  };
  // The nearest triangle on the ray, from either side. Asserts that `direction` is a unit vector.
  [[nodiscard]] std::optional<Hit> first_hit(const Vec3& origin, const Vec3& direction, double distance_max) const;

  // The winding number of the mesh about the point: 1 inside a closed mesh, 0 outside, between them for an open mesh.
  // Far clusters of triangles count as dipoles: the error is at most a few hundredths (Barill et al. 2018, "Fast
  // Winding Numbers").
  [[nodiscard]] double winding_number(const Vec3& point) const;
  [[nodiscard]] bool inside(const Vec3& point) const { return winding_number(point) > 0.5; }

 private:
  struct Corners {
    Vec3 a, b, c;
    // The index of the triangle in the mesh.
    std::uint32_t triangle;
  };
  struct Box {
    Vec3 low, high;
    // The box has the triangles corners_[begin] up to corners_[end], exclusive.
    std::uint32_t begin, end;
    // The index of the box's second child; zero means a leaf. The first child follows its parent.
    std::uint32_t second;
    // The area-weighted centre, and the sum of area vectors.
    Vec3 dipole_centre, dipole;
    // The ball of this radius about dipole_centre contains all triangles.
    double dipole_radius;
  };
  std::uint32_t add_box(std::uint32_t begin, std::uint32_t end);
  void find_closest(std::uint32_t box, const Vec3& point, Closest& best) const;
  void find_hit(std::uint32_t box, const Vec3& origin, const Vec3& direction, std::optional<Hit>& best,
                double& limit) const;
  [[nodiscard]] double solid_angle(std::uint32_t box, const Vec3& point) const;

  // The triangles in the order of the tree, so that each box has consecutive ones.
  std::vector<Corners> corners_;
  // The root is first, and a box's first child follows it.
  std::vector<Box> boxes_;
};

}  // namespace hairnet
