#pragma once

#include "core/ffd/skin_push.hpp"

namespace hairnet {

// Returns what SkinPush::push makes of `point`, in double: tests compare that function and the shaders with it. `rest`
// and `blend` are as there. Not for production.
Vec3 reference_skin_push(const SkinPush& skin, const Pose& pose, const Vec3& rest, double blend, const Vec3& point);

}  // namespace hairnet
