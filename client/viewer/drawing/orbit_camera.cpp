#include "client/viewer/drawing/orbit_camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hairnet::viewer {
namespace {

// The limit, in radians, is a little less than a right angle: at the poles up and forward would be parallel.
constexpr double kPitchMax = 1.54;
// Nearer than this the eye is in the hair; further away a head is less than a pixel.
constexpr double kDistanceMin_m = 0.12, kDistanceMax_m = 500;
// A step of the wheel changes the distance by this factor, so zooming feels alike at all distances.
constexpr double kZoomStep = 0.88;
// The followed motion is smoothed over about this time.
constexpr double kFollow_s = 0.2;
// The camera stands this much farther away than a framed sphere needs.
constexpr double kFrameMargin = 1.12;
const double kHalfAngle = OrbitCamera::kFov_deg / 2 * std::numbers::pi / 180;

}  // namespace

std::optional<double> hit_sphere(const Ray& ray, const Vec3& centre, double radius_m) {
  const Vec3 to = centre - ray.origin;
  const double along = to.dot(ray.direction);
  const double half_chord_squared = radius_m * radius_m - (to.squaredNorm() - along * along);
  // The negated form also misses for what is no number.
  if (!(half_chord_squared >= 0)) return {};
  const double half_chord = std::sqrt(half_chord_squared);
  if (along + half_chord < 0) return {};
  // An origin inside the sphere hits it at once.
  return std::max(0.0, along - half_chord);
}

void OrbitCamera::orbit(double right_px, double down_px, int height_px) {
  const double per_px = std::numbers::pi / std::max(1, height_px);
  // remainder() keeps the angle small, however often the camera goes round.
  yaw_ = std::remainder(yaw_ - right_px * per_px, 2 * std::numbers::pi);
  pitch_ = std::clamp(pitch_ + down_px * per_px, -kPitchMax, kPitchMax);
}

void OrbitCamera::pan(double right_px, double down_px, int height_px) {
  target_ += pixel_m(height_px) * (down_px * up() - right_px * right());
}

void OrbitCamera::zoom(double steps) {
  distance_m_ = std::clamp(distance_m_ * std::pow(kZoomStep, steps), kDistanceMin_m, kDistanceMax_m);
}

void OrbitCamera::frame(const Vec3& centre, double radius_m) {
  target_ = centre;
  followed_.reset();
  // A sphere touches the edge of the view at the sine of the half angle, not at its tangent.
  distance_m_ = std::clamp(kFrameMargin * radius_m / std::sin(kHalfAngle), kDistanceMin_m, kDistanceMax_m);
}

void OrbitCamera::look_from(const Vec3& direction) {
  yaw_ = std::atan2(direction.x(), direction.z());
  pitch_ = std::clamp(std::asin(std::clamp(direction.y(), -1.0, 1.0)), -kPitchMax, kPitchMax);
}

void OrbitCamera::follow(const std::optional<Vec3>& point, double elapsed_s) {
  // The first point, also after none, is only noted: moving to it would be a jump.
  if (!point || !followed_) {
    followed_ = point;
    return;
  }
  // Exponential, so that pictures of any length give the same path.
  const Vec3 step = (1 - std::exp(-std::max(0.0, elapsed_s) / kFollow_s)) * (*point - *followed_);
  *followed_ += step;
  target_ += step;
}

Vec3 OrbitCamera::backward() const {
  return {std::sin(yaw_) * std::cos(pitch_), std::sin(pitch_), std::cos(yaw_) * std::cos(pitch_)};
}

Vec3 OrbitCamera::right() const {
  return {std::cos(yaw_), 0, -std::sin(yaw_)};
}

Vec3 OrbitCamera::up() const {
  return backward().cross(right());
}

draw::Camera OrbitCamera::camera() const {
  draw::Camera camera;
  camera.eye = target_ + distance_m_ * backward();
  camera.target = target_;
  camera.fov_deg = static_cast<float>(kFov_deg);
  return camera;
}

Ray OrbitCamera::ray(double x_px, double y_px, int width_px, int height_px) const {
  const double half_height = std::tan(kHalfAngle), per_px = 2 * half_height / std::max(1, height_px);
  const double x = (x_px - 0.5 * width_px) * per_px, y = (0.5 * height_px - y_px) * per_px;
  return {target_ + distance_m_ * backward(), (x * right() + y * up() - backward()).normalized()};
}

double OrbitCamera::pixel_m(int height_px) const {
  return 2 * std::tan(kHalfAngle) * distance_m_ / std::max(1, height_px);
}

double OrbitCamera::height_share(const Vec3& centre, double diameter_m) const {
  const double depth = (target_ + distance_m_ * backward() - centre).dot(backward());
  return depth > 1e-3 ? diameter_m / (2 * std::tan(kHalfAngle) * depth) : 0;
}

bool OrbitCamera::in_view(const Vec3& centre, double radius_m, double aspect) const {
  const Vec3 from_eye = centre - (target_ + distance_m_ * backward());
  const double depth = -from_eye.dot(backward());
  if (depth < -radius_m) return false;
  // The distance outside the planes of the view's sides. A sphere is in view when it reaches within them.
  const auto inside = [&](double across, double tangent) {
    return (std::abs(across) - depth * tangent) / std::sqrt(1 + tangent * tangent) <= radius_m;
  };
  const double tangent = std::tan(kHalfAngle);
  return inside(from_eye.dot(right()), tangent * aspect) && inside(from_eye.dot(up()), tangent);
}

}  // namespace hairnet::viewer
