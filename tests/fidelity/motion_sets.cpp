#include "tests/fidelity/motion_sets.hpp"

#include <algorithm>
#include <cmath>

#include "client/assets/upright.hpp"
#include "core/smoothstep.hpp"

namespace hairnet::fidelity {
namespace {

// The seam between two rounds takes kSeam_s, or longer where the head would move or turn faster than these speeds.
constexpr double kSeam_s = 0.25, kSeamSpeed_m_per_s = 2, kSeamTurn_rad_per_s = 4;

// Returns the place on the floor below the head, with the heading of the head.
RigidTransform footing(const Pose& pose) {
  RigidTransform place = upright(pose).head();
  place.position.y() = 0;
  return place;
}

// The difference between the next round of a motion and the motion: its place, and the part that is eased out.
struct Round {
  RigidTransform place;
  // One entry for each bone, in the bone's own space.
  std::array<RigidTransform, kBoneCount> left_over;
  double seam_s = kSeam_s;
};

Round next_round(const Pose& first, const Pose& last) {
  Round round{footing(last) * footing(first).inverse(), {}};
  for (std::size_t b = 0; b < kBoneCount; ++b)
    round.left_over[b] = (round.place * first.bones[b]).inverse() * last.bones[b];
  const RigidTransform& head = round.left_over[0];
  round.seam_s = std::max({kSeam_s, head.position.norm() / kSeamSpeed_m_per_s,
                           head.rotation.angularDistance(Quat::Identity()) / kSeamTurn_rad_per_s});
  return round;
}

Pose in_round(const Round& round, const Pose& pose, double time_s) {
  const double share = smoothstep(std::min(1.0, time_s / round.seam_s));
  Pose placed;
  for (std::size_t b = 0; b < kBoneCount; ++b)
    placed.bones[b] = round.place * pose.bones[b] * interpolate(round.left_over[b], {}, share);
  return placed;
}

}  // namespace

Motion looped(const Motion& motion, double duration_s) {
  Motion all = motion;
  const auto pose_count = static_cast<std::size_t>(std::ceil(duration_s * motion.rate_hz)) + 1;
  while (motion.poses.size() > 1 && all.poses.size() < pose_count) {
    const Round round = next_round(motion.poses.front(), all.poses.back());
    for (std::size_t i = 1; i < motion.poses.size(); ++i) {
      all.poses.push_back(in_round(round, motion.poses[i], static_cast<double>(i) / motion.rate_hz));
      if (!motion.teleports.empty()) all.teleports.push_back(motion.teleports[i]);
    }
  }
  return all;
}

Motion stopped(const Motion& motion, double time_s, double duration_s) {
  Motion all = motion;
  const auto last = static_cast<std::size_t>(time_s * motion.rate_hz);
  const auto pose_count = static_cast<std::size_t>(std::ceil(duration_s * motion.rate_hz)) + 1;
  all.poses.resize(std::min(last + 1, motion.poses.size()));
  all.poses.resize(std::max(pose_count, all.poses.size()), all.poses.back());
  all.teleports.clear();
  return all;
}

}  // namespace hairnet::fidelity
