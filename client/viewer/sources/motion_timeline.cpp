#include "client/viewer/sources/motion_timeline.hpp"

#include <algorithm>
#include <cmath>

#include "client/assets/upright.hpp"

namespace hairnet::viewer {
namespace {

// The end of a clip meets its beginning if the head's place and rotation differ by less than this. A jump so small does
// not disturb the hair.
constexpr double kSeam_m = 0.02, kSeam_rad = 0.1;

// Whether the clip itself contains a jump. It then continues at another place, and its drift cannot be measured.
bool has_teleport(const Motion& motion) {
  return std::find(motion.teleports.begin(), motion.teleports.end(), true) != motion.teleports.end();
}

}  // namespace

MotionTimeline::MotionTimeline(const Motion& motion, double duration_s, Loop loop)
    : motion_(motion), duration_s_(duration_s), period_s_(motion.duration_s()) {
  const RigidTransform &first = motion.poses.front().head(), &last = motion.poses.back().head();
  loops_smoothly_ =
      (first.position - last.position).norm() < kSeam_m && first.rotation.angularDistance(last.rotation) < kSeam_rad;
  if (loops_smoothly_ || loop == Loop::plain || !(period_s_ > 0) || has_teleport(motion)) return;
  loops_smoothly_ = eases_seam_ = true;
  drift_m_per_s_ = (last.position - first.position) / period_s_;
  // Only the way on the floor is taken off: height and turning are part of the motion.
  drift_m_per_s_.y() = 0;
}

Pose MotionTimeline::clip(double time_s) const {
  if (!(period_s_ > 0)) return motion_.sample(0);
  const double t = std::fmod(time_s, period_s_);
  Pose pose = motion_.sample(t);
  if (!eases_seam_) return pose;
  for (RigidTransform& bone : pose.bones) bone.position -= t * drift_m_per_s_;
  // A short clip eases over half of itself at most.
  const double seam_s = std::min(kSeam_s, period_s_ / 2);
  return ease(pose, motion_.poses.front(), t - (period_s_ - seam_s), seam_s);
}

Pose MotionTimeline::at(double time_s) const {
  if (time_s < 0) {
    const Pose& first = motion_.poses.front();
    return ease(upright(first), first, time_s + kLeadIn_s, kLeadIn_s);
  }
  if (time_s < duration_s_) return clip(time_s);
  // A clip that ends exactly at that time has not begun again.
  const Pose last = clip(duration_s_ - 1e-6);
  // The bones ease to the upright pose at the place where the clip ended.
  return ease(last, upright(last), time_s - duration_s_, kEaseUpright_s);
}

bool MotionTimeline::teleports(double from_s, double to_s) const {
  // Neither the lead-in nor the end jumps.
  if (from_s < 0 || from_s >= duration_s_ || !(period_s_ > 0)) return false;
  const double from_round = std::floor(from_s / period_s_), to_round = std::floor(to_s / period_s_);
  const double from = from_s - from_round * period_s_, to = to_s - to_round * period_s_;
  if (from_round == to_round) return motion_.teleports_within(from, to);
  // The interval passes the end of a round, where a clip that does not loop smoothly jumps.
  return !loops_smoothly_ || motion_.teleports_within(from, period_s_) || motion_.teleports_within(0, to);
}

}  // namespace hairnet::viewer
