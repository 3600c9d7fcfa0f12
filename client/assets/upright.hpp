#pragma once

#include "core/pose/pose.hpp"

namespace hairnet {

// The design, upright where `pose` has the head and facing as it faces: all bones as one, turned about +Y only.
Pose upright(const Pose& pose);

// From `from` at 0 s to `to` at `duration_s` and after, starting and ending without speed.
Pose ease(const Pose& from, const Pose& to, double time_s, double duration_s);

}  // namespace hairnet
