#pragma once

#include "core/levels/level.hpp"

namespace hairnet {

// Sorts stiffeners by their lists of nodes, lexicographically; the sort is stable. Neighbours in the list then share
// most of their nodes, which keeps the solver in the L1 cache, and the order of its sums does not depend on the
// strands' order. Asserts that the counts of the list agree.
void order_by_nodes(Stiffeners& list);

}  // namespace hairnet
