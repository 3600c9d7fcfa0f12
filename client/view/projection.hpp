#pragma once

#include "client/view/renderer.hpp"

namespace hairnet::view {

using Mat4f = Eigen::Matrix4f;

// A camera that no picture can fail on: not-finite values, zero distances and parallel axes are mended, the field of
// view is held in 1 … 150 degrees.
Camera mended(const Camera& camera);

// World to clip space, near and far in m along the view.
Mat4f perspective(const Camera& camera, float aspect, float near_m, float far_m);

// World to the clip space of parallel light: a sphere fills the square, depth runs over `depth_m` about its centre.
Mat4f parallel(const Vec3f& towards_light, const Vec3f& centre, float radius_m, float depth_m);

}  // namespace hairnet::view
