#include "client/assets/upright.hpp"

#include <cmath>

#include "core/smoothstep.hpp"

namespace hairnet {

Pose upright(const Pose& pose) {
  // Only the direction of the face in the horizontal plane counts, so a nodding head keeps its heading.
  const Vec3 facing = pose.head().vector(Vec3::UnitZ());
  const double yaw = std::atan2(facing.x(), facing.z());
  return rigid_pose({Quat(Eigen::AngleAxisd(yaw, Vec3::UnitY())), pose.head().position});
}

Pose ease(const Pose& from, const Pose& to, double time_s, double duration_s) {
  return interpolate(from, to, smoothstep(0.0, duration_s, time_s));
}

}  // namespace hairnet
