#include "client/tools/sim/clip.hpp"

#include <cmath>

#include "client/assets/upright.hpp"

namespace hairnet::sim {
namespace {

// The time in which the head eases upright, the same as MotionTimeline's, so that both programs settle alike.
constexpr double kEaseUpright_s = 1;

}  // namespace

Clip make_clip(const Motion& motion, double rate_hz, double settle_s) {
  Clip clip;
  // Rounding must not add a tick to a clip whose length is a whole number of ticks: 2 s at 30 Hz may come out a little
  // above 60.
  clip.motion_tick_count = static_cast<std::size_t>(std::ceil(motion.duration_s() * rate_hz - 1e-9));
  for (std::size_t i = 0; i <= clip.motion_tick_count; ++i) {
    const double time_s = static_cast<double>(i) / rate_hz;
    // Rounded as on the wire, so that a server that gets these poses steps the same numbers.
    clip.poses.push_back(rounded_to_wire(motion.sample(time_s)));
    // Tick i ends at pose i, so a jump within its interval belongs to it.
    clip.teleports.push_back(i > 0 && motion.teleports_within(time_s - 1 / rate_hz, time_s));
  }
  const Pose last = clip.poses.back();
  const Pose rest = upright(last);
  const auto settle_tick_count = static_cast<std::size_t>(std::ceil(settle_s * rate_hz - 1e-9));
  for (std::size_t i = 1; i <= settle_tick_count; ++i) {
    clip.poses.push_back(rounded_to_wire(ease(last, rest, static_cast<double>(i) / rate_hz, kEaseUpright_s)));
    clip.teleports.push_back(false);
  }
  return clip;
}

}  // namespace hairnet::sim
