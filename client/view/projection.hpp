#pragma once

#include "client/view/camera.hpp"

namespace hairnet::view {

using Mat4f = Eigen::Matrix4f;

// A camera that no picture can fail on: not-finite values, zero distances and parallel axes are mended, the field of
// view is held in 1 … 150 degrees.
Camera mended(const Camera& camera);

// View axes of the camera: world directions to x right, y up, z backwards.
Eigen::Matrix3d view_rotation(const Camera& camera);

// View to clip space, near and far in m along the view.
Mat4f perspective(const Camera& camera, float aspect, float near_m, float far_m);

}  // namespace hairnet::view
