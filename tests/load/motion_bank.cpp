#include "tests/load/motion_bank.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/assets/load_motion.hpp"

namespace hairnet::load {

Result<MotionBank> MotionBank::load(const std::vector<std::string>& specs, double pose_hz) {
  std::vector<Motion> motions;
  for (const std::string& spec : specs) {
    auto motion = load_motion(spec);
    if (!motion) return Refusal(spec + ": " + motion.error());
    motions.push_back(std::move(*motion));
  }
  return of(std::move(motions), pose_hz);
}

MotionBank MotionBank::of(std::vector<Motion> motions, double pose_hz) {
  MotionBank bank;
  for (const Motion& motion : motions) {
    const auto count = static_cast<std::size_t>(std::max(1.0, std::floor(motion.duration_s() * pose_hz)));
    Loop loop;
    for (std::size_t i = 0; i < count; ++i) {
      const double time_s = static_cast<double>(i) / pose_hz;
      loop.poses.push_back(motion.sample(time_s));
      loop.teleports.push_back(i > 0 && motion.teleports_within(time_s - 1 / pose_hz, time_s));
    }
    const Pose &last = loop.poses.back(), &before = loop.poses[count > 1 ? count - 2 : 0];
    loop.teleports.front() =
        is_teleport(last, loop.poses.front(), 1 / pose_hz, head_velocity(before, last, 1 / pose_hz));
    bank.loops_.push_back(std::move(loop));
  }
  return bank;
}

MotionBank::Step MotionBank::step(std::size_t motion, std::uint64_t index) const {
  const Loop& loop = loops_[motion % loops_.size()];
  const std::size_t at = index % loop.poses.size();
  return {&loop.poses[at], loop.teleports[at]};
}

}  // namespace hairnet::load
