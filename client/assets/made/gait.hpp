#pragma once

#include "client/assets/made/rig.hpp"
#include "client/assets/made/variation.hpp"

namespace hairnet::made {

// How far a person bobs and sways at each step, and how many steps a second there are.
struct Gait {
  double step_hz = 0, bob_m = 0, sway_m = 0;
};

// Lets head and trunk follow the steps. `amount` scales everything, from 0, standing, to 1.
void add_gait(Gesture& gesture, const MotionVariation& variation, double t, const Gait& gait, double amount = 1);

}  // namespace hairnet::made
