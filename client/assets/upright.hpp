#pragma once

#include "core/pose/pose.hpp"

namespace hairnet {

// The design upright at the place and heading of `pose`'s head: all bones have one transform, turned about +Y only.
Pose upright(const Pose& pose);

// Eases from `from` at 0 s to `to` at `duration_s` and after, with zero speed at both ends.
Pose ease(const Pose& from, const Pose& to, double time_s, double duration_s);

}  // namespace hairnet
