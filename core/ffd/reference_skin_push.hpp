#pragma once

#include "core/ffd/skin_push.hpp"

namespace hairnet {

// Returns where SkinPush::push moves a deformed `point`, computed in double. `rest` is the point in the design, head
// space, and `blend` its root blend. Only tests use it: they compare SkinPush and the shaders with it.
Vec3 reference_skin_push(const SkinPush& skin, const Pose& pose, const Vec3& rest, double blend, const Vec3& point);

}  // namespace hairnet
