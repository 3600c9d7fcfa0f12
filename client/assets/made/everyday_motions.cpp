#include "client/assets/made/everyday_motions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "client/assets/made/easing.hpp"
#include "client/assets/made/gait.hpp"

namespace hairnet::made {
namespace {

// Seconds since the last of the starts `first_s`, `first_s` + `period_s`, ...; negative before the first. A negative
// value makes the eases below give 0.
double since_start(double t, double first_s, double period_s) {
  return t < first_s ? t - first_s : std::fmod(t - first_s, period_s);
}

// Rises from 0 to 1 within `in_s`, and falls from 1 to 0 within the `out_s` before `end_s`.
double plateau(double t, double in_s, double out_s, double end_s) {
  return smootherstep(0, in_s, t) * (1 - smootherstep(end_s - out_s, end_s, t));
}

}  // namespace

// It walks for 3.8 s of every 6, so that hair swings, settles and starts again.
Gesture walk_and_stop(const MotionVariation& variation, std::uint32_t, double t) {
  const double amount = plateau(since_start(t, 1, 6), 0.6, 0.5, 3.8);
  Gesture g;
  add_gait(g, variation, t, {1.9 * variation.tempo, 0.045 * variation.size, 0.02}, amount);
  g.speed_m_per_s = 1.35 * variation.tempo * amount;
  return g;
}

Gesture side_step(const MotionVariation& variation, std::uint32_t, double t) {
  constexpr double kWay_m = 0.3, kStep_s = 0.5, kPeriod_s = 4;
  // The number of steps decides the side: even ones lead away, odd ones back.
  const double step = std::max(0.0, std::floor((t - kStep_s) / kPeriod_s)),
               since_s = since_start(t, kStep_s, kPeriod_s);
  const bool away = static_cast<long>(step) % 2 == 0;
  const double way = smootherstep(0, kStep_s, since_s), effort = variation.size * bump(since_s / kStep_s - 0.5);
  Gesture g;
  g.sway_m = kWay_m * (away ? way : 1 - way);
  g.lift_m = -0.02 * effort;
  g.trunk_roll = (away ? -0.05 : 0.05) * effort;
  g.head_roll = -0.6 * g.trunk_roll;
  return g;
}

// The speed jumps, as with a thumbstick in VR. It is a hard case for hair on purpose.
Gesture glide(const MotionVariation&, std::uint32_t, double t) {
  const double since_s = since_start(t, 1, 6);
  Gesture g;
  g.speed_m_per_s = since_s >= 0 && since_s < 3 ? 1.4 : 0;
  return g;
}

Gesture dash(const MotionVariation& variation, std::uint32_t, double t) {
  constexpr double kSpeed_m_per_s = 5;
  const double since_s = since_start(t, 1, 6);
  const double amount = plateau(since_s, 1, 0.6, 3.2);
  Gesture g;
  add_gait(g, variation, t, {3.2 * variation.tempo, 0.06 * variation.size, 0.02}, amount);
  // The trunk leans into the start and back against the braking; the head stays nearly upright.
  g.trunk_pitch = 0.16 * amount + 0.12 * bump(since_s - 0.5) - 0.25 * bump((since_s - 2.9) / 0.9);
  g.head_pitch -= 0.6 * g.trunk_pitch;
  g.speed_m_per_s = kSpeed_m_per_s * amount;
  return g;
}

Gesture turn_on_spot(const MotionVariation& variation, std::uint32_t, double t) {
  constexpr double kFirst_s = 1, kTurn_s = 1, kPeriod_s = 3.5;
  const double done = std::max(0.0, std::floor((t - kFirst_s) / kPeriod_s));
  const double since_s = since_start(t, kFirst_s, kPeriod_s);
  Gesture g;
  // The sum of turns never falls, so the body does not turn back at the end of a period.
  g.facing = std::numbers::pi * (done + smootherstep(0, kTurn_s, since_s));
  // The head turns first: its bump is centred at 0.4 of the turn.
  g.head_yaw = 0.3 * bump(since_s / kTurn_s - 0.4);
  // Two small dips are the two steps of a turn.
  g.lift_m = -0.015 * variation.size * (bump(2 * since_s / kTurn_s - 0.5) + bump(2 * since_s / kTurn_s - 1.5));
  return g;
}

Gesture lift(const MotionVariation&, std::uint32_t, double t) {
  constexpr double kSpeed_m_per_s = 1.5, kEase_s = 0.6;
  const auto way = [&](double start_s) { return smootherstep_integral(start_s, start_s + kEase_s, t); };
  Gesture g;
  // Up for three seconds, a rest, and down for three seconds: the four ways add up to 0.
  g.lift_m = kSpeed_m_per_s * (way(1) - way(4) - way(7) + way(10));
  return g;
}

Gesture late_nod(const MotionVariation& variation, std::uint32_t, double t) {
  // The first four seconds are still, so hair settles before it is moved.
  const double since_s = since_start(t, 4, 5);
  return {.head_pitch = 0.45 * variation.size * (bump(since_s - 0.5) + 0.7 * bump((since_s - 0.95) / 0.8))};
}

Gesture look(const MotionVariation& variation, std::uint32_t, double t) {
  struct Gaze {
    double start_s, yaw, pitch;
  };
  constexpr double kTurn_s = 0.7;
  // Times and angles of a person who looks left, right, ahead, up, down and ahead, with a rest after each.
  constexpr std::array<Gaze, 6> kGazes{{{1, 1.1, 0}, {3, -1.1, 0}, {5, 0, 0}, {7, 0, -0.55}, {9, 0, 0.6}, {11, 0, 0}}};
  double yaw = 0, pitch = 0;
  for (const Gaze& gaze : kGazes) {
    const double turned = smootherstep(gaze.start_s, gaze.start_s + kTurn_s, t);
    yaw = mix(yaw, variation.size * gaze.yaw, turned);
    pitch = mix(pitch, gaze.pitch, turned);
  }
  // The trunk takes a part of a far look, as a person's does.
  return {.trunk_yaw = 0.15 * yaw, .head_yaw = 0.85 * yaw, .head_pitch = pitch};
}

}  // namespace hairnet::made
