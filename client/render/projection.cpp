#include "client/render/projection.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hairnet::render {
namespace {

// Any direction across this one; the axis that is far from parallel to it keeps the result well defined.
Vec3 any_across(const Vec3& direction) {
  const Vec3 axis = std::abs(direction.y()) < 0.9 ? Vec3::UnitY() : Vec3::UnitZ();
  return (axis - direction * direction.dot(axis)).normalized();
}

}  // namespace

draw::Camera sanitized(const draw::Camera& camera) {
  draw::Camera c = camera;
  if (!c.target.allFinite()) c.target = Vec3::Zero();
  // Distances below this make directions of rounding errors.
  if (!c.eye.allFinite() || (c.eye - c.target).norm() < 1e-4f) c.eye = c.target + Vec3::UnitZ();
  const Vec3 forward = (c.target - c.eye).normalized();
  // `up` along the view says nothing about what is up in the picture.
  if (!c.up.allFinite() || c.up.cross(forward).norm() < 1e-4f * c.up.norm() || c.up.norm() < 1e-6f) {
    c.up = any_across(forward);
  }
  c.fov_deg = std::isfinite(c.fov_deg) ? std::clamp(c.fov_deg, 1.0f, 150.0f) : draw::Camera{}.fov_deg;
  return c;
}

Eigen::Matrix3d view_rotation(const draw::Camera& camera) {
  const Vec3 forward = (camera.target - camera.eye).normalized();
  const Vec3 right = forward.cross(camera.up).normalized();
  Eigen::Matrix3d m;
  m.row(0) = right;
  m.row(1) = right.cross(forward);
  m.row(2) = -forward;
  return m;
}

Mat4f perspective(const draw::Camera& camera, float aspect, float near_m, float far_m) {
  const float scale = 1.0f / std::tan(camera.fov_deg * std::numbers::pi_v<float> / 360.0f);
  Mat4f m = Mat4f::Zero();
  m(0, 0) = scale / aspect;
  m(1, 1) = scale;
  m(2, 2) = (far_m + near_m) / (near_m - far_m);
  m(2, 3) = 2.0f * far_m * near_m / (near_m - far_m);
  m(3, 2) = -1.0f;
  return m;
}

Mat4f shifted(const Mat4f& projection, float shift_x, float shift_y) {
  // Row 3 gives w: adding a share of w moves a point by that share after the division.
  Mat4f m = projection;
  m.row(0) += 2 * shift_x * projection.row(3);
  m.row(1) += 2 * shift_y * projection.row(3);
  return m;
}

}  // namespace hairnet::render
