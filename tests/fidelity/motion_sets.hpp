#pragma once

#include <span>
#include <string_view>

#include "core/pose/motion.hpp"

namespace hairnet::fidelity {

// Everyday motions, rare and wild motions, and postures that people stay in.
inline constexpr std::string_view kEverydayMotions[] = {
    "made:walk_and_stop", "made:side_step", "made:jump", "made:glide", "made:dash", "made:turn_on_spot",
    "made:lift",          "made:late_nod",  "made:look", "cmu_131_01", "cmu_131_02"};
inline constexpr std::string_view kWildMotions[] = {"dance_a",    "spinkick", "run",       "jump",
                                                    "cartwheel",  "backflip", "spin",      "getup_faceup",
                                                    "made:dance", "made:run", "made:shake"};
inline constexpr std::string_view kPostures[] = {"made:lie_down", "made:upside_down"};

// Repeats the motion until `duration_s`. Each round begins at the place and heading at which the previous one ended.
// The rest of the difference between its first pose and the last one is eased out within a quarter of a second, or
// longer where a person could not move so fast.
Motion looped(const Motion& motion, double duration_s);

// Runs the motion to `time_s`, then keeps its pose there until `duration_s`.
Motion stopped(const Motion& motion, double time_s, double duration_s);

}  // namespace hairnet::fidelity
