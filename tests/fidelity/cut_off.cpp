#include "tests/fidelity/cut_off.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace hairnet::fidelity {

NodeTrajectory follow(const Stepper& stepper, const Clip& clip, int substeps, float stiffness) {
  using Clock = std::chrono::steady_clock;
  NodeTrajectory trajectory{1 / clip.rate_hz, {}, 0};
  Clock::duration spent{};
  for (std::size_t tick = 1; tick < clip.poses.size(); ++tick) {
    StepInput input;
    input.to = clip.poses[tick - 1];
    input.step_s = trajectory.tick_s / substeps;
    input.material.stiffness = stiffness;
    const Clock::time_point begin = Clock::now();
    for (int s = 1; s <= substeps; ++s) {
      input.from = input.to;
      input.to = interpolate(clip.poses[tick - 1], clip.poses[tick], static_cast<double>(s) / substeps);
      stepper.step(input);
    }
    spent += Clock::now() - begin;
    if (tick >= clip.lead_in_ticks) trajectory.ticks.push_back(stepper.displacement());
  }
  trajectory.tick_us = 1e6 * std::chrono::duration<double>(spent).count() / static_cast<double>(clip.tick_count());
  return trajectory;
}

NodeTrajectory integrate(const Level& level, const Motion& motion, const CutOff& setting, float stiffness,
                         double duration_s) {
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  const Stepper stepper{[&](const StepInput& input) {
                          if (!step(level, input, {.iterations = setting.iterations}, scratch, state))
                            reset_to_rest(level, state);
                        },
                        [&] { return state.displacement; }};
  return follow(stepper, make_clip(motion, setting.rate_hz, duration_s), setting.substeps, stiffness);
}

double relative_error(const Level& level, const NodeTrajectory& a, const NodeTrajectory& truth) {
  double error2 = 0, motion2 = 0;
  for (std::size_t t = 0; t < a.ticks.size(); ++t) {
    const double at = static_cast<double>(t) * a.tick_s / truth.tick_s;
    const auto low = static_cast<std::size_t>(at);
    if (low + 1 >= truth.ticks.size()) break;
    const auto s = static_cast<float>(at - static_cast<double>(low));
    for (std::size_t i = 0; i < level.rest.size(); ++i) {
      const Vec3f d = (1 - s) * truth.ticks[low][i] + s * truth.ticks[low + 1][i];
      error2 += static_cast<double>(level.mass[i] * (a.ticks[t][i] - d).squaredNorm());
      motion2 += static_cast<double>(level.mass[i] * d.squaredNorm());
    }
  }
  return std::sqrt(error2 / std::max(motion2, 1e-30));
}

}  // namespace hairnet::fidelity
