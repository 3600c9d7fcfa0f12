#include "client/view/projection.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hairnet::view {
namespace {

Mat4f look(const Vec3f& eye, const Vec3f& forward, const Vec3f& up) {
  const Vec3f right = forward.cross(up).normalized();
  Mat4f m = Mat4f::Identity();
  m.block<1, 3>(0, 0) = right.transpose();
  m.block<1, 3>(1, 0) = right.cross(forward).transpose();
  m.block<1, 3>(2, 0) = -forward.transpose();
  m.block<3, 1>(0, 3) = -(m.block<3, 3>(0, 0) * eye);
  return m;
}

Vec3f any_across(const Vec3f& direction) {
  const Vec3f axis = std::abs(direction.y()) < 0.9f ? Vec3f::UnitY() : Vec3f::UnitZ();
  return (axis - direction * direction.dot(axis)).normalized();
}

}  // namespace

Camera mended(const Camera& camera) {
  Camera c = camera;
  if (!c.target.allFinite()) c.target = Vec3f::Zero();
  if (!c.eye.allFinite() || (c.eye - c.target).norm() < 1e-4f) c.eye = c.target + Vec3f::UnitZ();
  const Vec3f forward = (c.target - c.eye).normalized();
  if (!c.up.allFinite() || c.up.cross(forward).norm() < 1e-4f * c.up.norm() || c.up.norm() < 1e-6f) {
    c.up = any_across(forward);
  }
  c.fov_deg = std::isfinite(c.fov_deg) ? std::clamp(c.fov_deg, 1.0f, 150.0f) : Camera{}.fov_deg;
  return c;
}

Mat4f perspective(const Camera& camera, float aspect, float near_m, float far_m) {
  const float scale = 1.0f / std::tan(camera.fov_deg * std::numbers::pi_v<float> / 360.0f);
  Mat4f m = Mat4f::Zero();
  m(0, 0) = scale / aspect;
  m(1, 1) = scale;
  m(2, 2) = (far_m + near_m) / (near_m - far_m);
  m(2, 3) = 2.0f * far_m * near_m / (near_m - far_m);
  m(3, 2) = -1.0f;
  return m * look(camera.eye, (camera.target - camera.eye).normalized(), camera.up);
}

Mat4f parallel(const Vec3f& towards_light, const Vec3f& centre, float radius_m, float depth_m) {
  Mat4f m = Mat4f::Identity();
  m(0, 0) = m(1, 1) = 1.0f / radius_m;
  m(2, 2) = -2.0f / depth_m;
  return m * look(centre, -towards_light, any_across(towards_light));
}

}  // namespace hairnet::view
