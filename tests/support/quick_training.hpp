#pragma once

#include "core/modes/snapshots.hpp"

namespace hairnet::support {

// Training with so little motion that the modes are poor but made quickly. Use it in tests whose result does not depend
// on the modes.
inline constexpr ModeTraining kQuickTraining{.motion_count = 2, .duration_s = 0.5, .snapshot_s = 0.1};

}  // namespace hairnet::support
