#include "core/geometry/mesh_query.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace hairnet {
namespace {

// Returns a closed sphere of radius 1 whose triangles are counter-clockwise seen from outside.
TriangleMesh make_sphere(int rings, int sectors) {
  TriangleMesh mesh;
  for (int r = 0; r <= rings; ++r) {
    const double theta = std::numbers::pi * r / rings;
    for (int s = 0; s < sectors; ++s) {
      const double phi = 2 * std::numbers::pi * s / sectors;
      mesh.vertices.push_back(
          Vec3(std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi)).cast<float>());
    }
  }
  const auto at = [&](int r, int s) { return static_cast<std::uint32_t>(r * sectors + s % sectors); };
  for (int r = 0; r < rings; ++r) {
    for (int s = 0; s < sectors; ++s) {
      // At the pole this triangle has no area.
      mesh.triangles.push_back({at(r, s), at(r + 1, s), at(r + 1, s + 1)});
      mesh.triangles.push_back({at(r, s), at(r + 1, s + 1), at(r, s + 1)});
    }
  }
  return mesh;
}

// Returns random points of a cube with sides of twice `extent`, the same in every run.
std::vector<Vec3> random_points(int count, double extent) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-extent, extent);
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) points.emplace_back(uniform(random), uniform(random), uniform(random));
  return points;
}

// Returns the winding number as the sum of the triangles' solid angles, without a tree.
double exact_winding_number(const TriangleMesh& mesh, const Vec3& p) {
  double sum = 0;
  for (const auto& [ia, ib, ic] : mesh.triangles) {
    const Vec3 a = mesh.vertices[ia].cast<double>() - p, b = mesh.vertices[ib].cast<double>() - p,
               c = mesh.vertices[ic].cast<double>() - p;
    sum += 2 * std::atan2(a.dot(b.cross(c)), a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() +
                                                 b.dot(c) * a.norm() + c.dot(a) * b.norm());
  }
  return sum / (4 * std::numbers::pi);
}

// Returns the distance to the nearest of many points of each triangle. It is never below the true distance, and above
// by at most the distance of two samples.
double sampled_distance(const TriangleMesh& mesh, const Vec3& p, int steps) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& [ia, ib, ic] : mesh.triangles) {
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const double u = double(i) / steps, v = double(j) / steps;
        const Vec3 x = (u * mesh.vertices[ia] + v * mesh.vertices[ib] + (1 - u - v) * mesh.vertices[ic]).cast<double>();
        best = std::min(best, (x - p).norm());
      }
    }
  }
  return best;
}

TEST(MeshQuery, closest_point_is_no_farther_than_any_sample_of_the_mesh) {
  const TriangleMesh mesh = make_sphere(8, 12);
  const MeshQuery query(mesh);
  for (const Vec3& p : random_points(60, 2)) {
    const MeshQuery::Closest closest = query.closest(p);
    const double sampled = sampled_distance(mesh, p, 8);
    EXPECT_LE(closest.distance, sampled + 1e-7);
    // The samples of a triangle lie less than 0.1 apart.
    EXPECT_GE(closest.distance, sampled - 0.1);
  }
}

// Callers read the weights of the named triangle, so a wrong name would bind hair to another bone.
TEST(MeshQuery, closest_point_lies_on_the_triangle_that_it_names) {
  const TriangleMesh mesh = make_sphere(8, 12);
  const MeshQuery query(mesh);
  for (const Vec3& p : random_points(200, 2)) {
    const MeshQuery::Closest closest = query.closest(p);
    const auto& triangle = mesh.triangles[closest.triangle];
    Vec3 x = Vec3::Zero();
    for (int corner = 0; corner < 3; ++corner) {
      x += closest.barycentric[corner] * mesh.vertices[triangle[corner]].cast<double>();
    }
    EXPECT_NEAR((x - closest.point).norm(), 0, 1e-12);
    EXPECT_NEAR((p - closest.point).norm(), closest.distance, 1e-12);
    EXPECT_NEAR(closest.barycentric.sum(), 1, 1e-9);
    EXPECT_GE(closest.barycentric.minCoeff(), 0);
  }
}

TEST(MeshQuery, closest_point_keeps_to_its_limit) {
  const MeshQuery query(make_sphere(8, 12));
  // The sphere's surface is 2 away from the point, but for its flat triangles.
  EXPECT_TRUE(std::isinf(query.closest({3, 0, 0}, 1.9).distance));
  EXPECT_NEAR(query.closest({3, 0, 0}, 2.1).distance, 2, 0.05);
}

TEST(MeshQuery, every_ray_from_the_middle_hits_at_the_radius) {
  const MeshQuery query(make_sphere(40, 60));
  for (const Vec3& p : random_points(500, 1)) {
    const auto hit = query.first_hit(Vec3::Zero(), p.normalized(), 10);
    ASSERT_TRUE(hit);
    // The flat triangles of 40 rings and 60 sectors lie up to 0.003 inside the sphere.
    EXPECT_NEAR(hit->distance, 1, 0.005);
    EXPECT_FALSE(query.first_hit(Vec3::Zero(), p.normalized(), 0.9));
  }
}

TEST(MeshQuery, rays_along_an_axis_hit_and_rays_that_pass_by_do_not) {
  const MeshQuery query(make_sphere(41, 61));
  const auto hit = query.first_hit({-5, 0.01, 0.02}, Vec3::UnitX(), 10);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance, 4, 0.01);
  EXPECT_FALSE(query.first_hit({-5, 0.01, 0.02}, -Vec3::UnitX(), 10));
  EXPECT_FALSE(query.first_hit({-5, 1.01, 0}, Vec3::UnitX(), 10));
}

TEST(MeshQuery, winding_number_agrees_with_the_exact_sum_of_solid_angles) {
  const TriangleMesh mesh = make_sphere(16, 24);
  const MeshQuery query(mesh);
  for (const Vec3& p : random_points(300, 2)) {
    EXPECT_NEAR(query.winding_number(p), exact_winding_number(mesh, p), 0.02);
    if (std::abs(p.norm() - 1) > 0.05) {
      EXPECT_EQ(query.inside(p), p.norm() < 1) << p.transpose();
    }
  }
}

TEST(MeshQuery, inside_is_right_for_a_mesh_with_a_small_hole) {
  TriangleMesh mesh = make_sphere(16, 24);
  // The last 96 triangles are the two lowest rings of 24 quads.
  mesh.triangles.erase(mesh.triangles.end() - 96, mesh.triangles.end());
  const MeshQuery query(mesh);
  for (const Vec3& p : random_points(300, 0.8)) {
    // Near the hole, at y below -0.92, the winding number passes through 0.5, so points farther out are not judged.
    if (p.norm() < 0.7) {
      EXPECT_TRUE(query.inside(p)) << p.transpose();
    }
  }
  EXPECT_FALSE(query.inside({0, -1.5, 0}));
}

TEST(MeshQuery, triangles_without_area_give_finite_answers) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  mesh.triangles = {{0, 0, 0}, {0, 1, 2}, {1, 1, 2}};
  const MeshQuery query(mesh);
  EXPECT_NEAR(query.closest({1.5, 1, 0}).distance, 1, 1e-12);
  EXPECT_NEAR(query.closest({-3, 4, 0}).distance, 5, 1e-12);
  EXPECT_NEAR(query.winding_number({0.5, 0.5, 0}), 0, 1e-12);
  EXPECT_NEAR(query.winding_number({1, 0, 0}), 0, 1e-12);
  EXPECT_FALSE(query.first_hit({1.5, 1, 0}, -Vec3::UnitY(), 5));
}

TEST(MeshQuery, an_empty_mesh_has_no_surface_and_no_inside) {
  const MeshQuery query{TriangleMesh{}};
  EXPECT_TRUE(query.empty());
  EXPECT_TRUE(std::isinf(query.closest(Vec3::Zero()).distance));
  EXPECT_FALSE(query.first_hit(Vec3::Zero(), Vec3::UnitX(), 1));
  EXPECT_FALSE(query.inside(Vec3::Zero()));
}

TEST(MeshQuery, many_coincident_triangles_do_not_stop_the_tree) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles.assign(10'000, {0, 1, 2});
  const MeshQuery query(mesh);
  EXPECT_NEAR(query.closest({0.2, 0.2, 3}).distance, 3, 1e-12);
  EXPECT_TRUE(query.first_hit({0.2, 0.2, 3}, -Vec3::UnitZ(), 5));
}

TEST(MeshQueryDeathTest, a_triangle_with_a_vertex_that_does_not_exist_stops_the_program) {
  const TriangleMesh mesh{{Vec3f::Zero(), Vec3f::UnitX()}, {{0, 1, 2}}};
  EXPECT_DEATH(MeshQuery{mesh}, "assertion failed: .* < mesh.vertices.size\\(\\)");
}

}  // namespace
}  // namespace hairnet
