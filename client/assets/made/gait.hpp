#pragma once

#include "client/assets/made/rig.hpp"
#include "client/assets/made/variation.hpp"

namespace hairnet::made {

// A person's bobbing and swaying at each step, and the steps a second.
struct Gait {
  double step_hz = 0, bob_m = 0, sway_m = 0;
};

// Makes head and trunk follow the steps. `amount` scales everything, from 0 (standing) to 1. It overwrites the fields
// that it sets, so callers add their own values afterwards.
void add_gait(Gesture& gesture, const MotionVariation& variation, double t, const Gait& gait, double amount = 1);

}  // namespace hairnet::made
