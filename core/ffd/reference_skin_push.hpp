#pragma once

#include "core/ffd/skin_push.hpp"

namespace hairnet {

// SkinPush of one point in double: tests compare it with the others. Not for production.
Vec3 reference_skin_push(const SkinPush& skin, const Pose& pose, const Vec3& rest, double blend, const Vec3& point);

}  // namespace hairnet
