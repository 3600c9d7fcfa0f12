#include "client/assets/upright.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet {

Pose upright(const Pose& pose) {
  const Vec3 facing = pose.head().vector(Vec3::UnitZ());
  const double yaw = std::atan2(facing.x(), facing.z());
  return rigid_pose({Quat(Eigen::AngleAxisd(yaw, Vec3::UnitY())), pose.head().position});
}

Pose ease(const Pose& from, const Pose& to, double time_s, double duration_s) {
  const double s = std::clamp(time_s / duration_s, 0.0, 1.0);
  return interpolate(from, to, s * s * (3 - 2 * s));
}

}  // namespace hairnet
