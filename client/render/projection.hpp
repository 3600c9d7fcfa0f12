#pragma once

#include "client/draw/camera.hpp"

namespace hairnet::render {

using Mat4f = Eigen::Matrix4f;

// Returns a camera that can always be drawn with: replaces values that are not finite, zero distances and parallel
// axes, and clamps the field of view to 1 … 150 degrees. A caller's bad value thus shows a wrong picture instead of
// none.
draw::Camera sanitized(const draw::Camera& camera);

// View axes of the camera: world directions to x right, y up, z backwards. The camera must be one of sanitized().
Eigen::Matrix3d view_rotation(const draw::Camera& camera);

// Maps view to clip space, as OpenGL does: depth -1 at `near_m` and 1 at `far_m`, m along the view. `aspect` is width
// over height.
Mat4f perspective(const draw::Camera& camera, float aspect, float near_m, float far_m);

// The projection whose picture is shifted by a share of its size. It moves all depths alike on the screen, so nothing
// changes but where samples lie.
Mat4f shifted(const Mat4f& projection, float shift_x, float shift_y);

}  // namespace hairnet::render
