#include "client/assets/made/gait.hpp"

#include "client/assets/made/easing.hpp"

namespace hairnet::made {

void add_gait(Gesture& g, const MotionVariation& variation, double t, const Gait& gait, double amount) {
  const double stride_hz = gait.step_hz / 2;  // a stride is two steps
  // The body is highest when a leg is straight below it, which happens at each step; it sways once to each side in a
  // stride.
  g.lift_m = amount * gait.bob_m * (wave(gait.step_hz, t, variation.phase) - 1) / 2;
  g.sway_m = amount * gait.sway_m * wave(stride_hz, t, variation.phase);
  // Trunk and head turn against each other, so that the gaze stays ahead.
  g.trunk_yaw = amount * 0.12 * wave(stride_hz, t, variation.phase + 0.25);
  g.trunk_roll = amount * 0.03 * wave(stride_hz, t, variation.phase);
  g.head_yaw = -amount * 0.10 * wave(stride_hz, t, variation.phase + 0.25);
  g.head_pitch = amount * 0.04 * wave(gait.step_hz, t, variation.phase + 0.1);
  // Shoulders swing with the arms, against each other.
  g.left_shoulder = g.trunk_yaw;
  g.right_shoulder = -g.trunk_yaw;
}

}  // namespace hairnet::made
