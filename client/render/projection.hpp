#pragma once

#include "client/draw/camera.hpp"

namespace hairnet::render {

using Mat4f = Eigen::Matrix4f;

// Returns a camera that can always be drawn with: replaces values that are not finite, zero distances and parallel
// axes, and clamps the field of view to 1 … 150 degrees.
draw::Camera mended(const draw::Camera& camera);

// View axes of the camera: world directions to x right, y up, z backwards.
Eigen::Matrix3d view_rotation(const draw::Camera& camera);

// View to clip space, near and far in m along the view.
Mat4f perspective(const draw::Camera& camera, float aspect, float near_m, float far_m);

// The projection whose picture is shifted by a share of its size.
Mat4f shifted(const Mat4f& projection, float shift_x, float shift_y);

}  // namespace hairnet::render
