#pragma once

#include "core/build/level.hpp"

namespace hairnet {

// By their lists of nodes, lexicographically; stiffeners of the same nodes keep their order. Those that follow each
// other then share most of their nodes, so that a pass of the solver finds them in the nearest cache, and the order of
// its sums is the level's own, not that of the strands.
void order_by_nodes(Stiffeners& list);

}  // namespace hairnet
