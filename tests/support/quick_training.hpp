#pragma once

#include "core/modes/snapshots.hpp"

namespace hairnet::support {

// So little motion that the modes are poor, for tests of what does not depend on them.
inline constexpr ModeTraining kQuickTraining{.motion_count = 2, .duration_s = 0.5, .snapshot_s = 0.1};

}  // namespace hairnet::support
