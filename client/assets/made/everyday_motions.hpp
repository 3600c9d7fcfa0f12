#pragma once

#include <cstdint>

#include "client/assets/made/rig.hpp"
#include "client/assets/made/variation.hpp"

namespace hairnet::made {

// The most common movements of people in a virtual room; the head stays upright. `t`: seconds from the motion's start.
// Most begin after a rest of a second or more and repeat. None uses `seed`: their chance is in the variation.
Gesture walk_and_stop(const MotionVariation& variation, std::uint32_t seed, double t);
Gesture side_step(const MotionVariation& variation, std::uint32_t seed, double t);
Gesture glide(const MotionVariation& variation, std::uint32_t seed, double t);
Gesture dash(const MotionVariation& variation, std::uint32_t seed, double t);
Gesture turn_on_spot(const MotionVariation& variation, std::uint32_t seed, double t);
Gesture lift(const MotionVariation& variation, std::uint32_t seed, double t);
Gesture late_nod(const MotionVariation& variation, std::uint32_t seed, double t);
Gesture look(const MotionVariation& variation, std::uint32_t seed, double t);

}  // namespace hairnet::made
