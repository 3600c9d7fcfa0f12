#include "client/tools/view/performance.hpp"

#include <cmath>

#include "client/tools/clip/upright.hpp"

namespace hairnet::viewer {
namespace {

// Closer than this the end of a clip meets its beginning.
constexpr double kSeam_m = 0.02, kSeam_rad = 0.1;

}  // namespace

Performance::Performance(const Motion& motion, double duration_s)
    : motion_(motion), duration_s_(duration_s), period_s_(motion.duration_s()) {
  const RigidTransform &first = motion.poses.front().head(), &last = motion.poses.back().head();
  loops_smoothly_ =
      (first.position - last.position).norm() < kSeam_m && first.rotation.angularDistance(last.rotation) < kSeam_rad;
}

Pose Performance::clip(double time_s) const {
  return motion_.sample(period_s_ > 0 ? std::fmod(time_s, period_s_) : 0);
}

Pose Performance::at(double time_s) const {
  if (time_s < 0) {
    const Pose& first = motion_.poses.front();
    return ease(upright(first), first, time_s + kLeadIn_s, kLeadIn_s);
  }
  if (time_s < duration_s_) return clip(time_s);
  const Pose last = clip(duration_s_ - 1e-6);  // a clip that ends just then has not begun again
  return ease(last, upright(last), time_s - duration_s_, kEaseUpright_s);
}

bool Performance::jumps(double from_s, double to_s) const {
  if (from_s < 0 || from_s >= duration_s_ || !(period_s_ > 0)) return false;
  const double from_round = std::floor(from_s / period_s_), to_round = std::floor(to_s / period_s_);
  const double from = from_s - from_round * period_s_, to = to_s - to_round * period_s_;
  if (from_round == to_round) return motion_.teleports_within(from, to);
  return !loops_smoothly_ || motion_.teleports_within(from, period_s_) || motion_.teleports_within(0, to);
}

}  // namespace hairnet::viewer
