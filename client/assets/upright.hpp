#pragma once

#include "core/pose/pose.hpp"

namespace hairnet {

// The design upright at the place and heading of `pose`'s head: all bones have one transform, turned about +Y only. A
// head that looks straight up or down has the yaw of its small remaining horizontal part.
Pose upright(const Pose& pose);

// Eases from `from` at 0 s to `to` at `duration_s` and after, with zero speed at both ends. `duration_s` must be
// positive. Callers ease between a clip and rest, since a jump would whip the hair.
Pose ease(const Pose& from, const Pose& to, double time_s, double duration_s);

}  // namespace hairnet
