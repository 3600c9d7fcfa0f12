#pragma once

#include <span>

#include "client/assets/import/placement.hpp"

namespace hairnet {

// Whether the strands are stored tip first. Roots lie on the shell of a skull with no hair inside; tips do not. Both
// ends are compared; where neither is clearly the better scalp, the first points are the roots, as formats have them.
// Files of fewer than 8 strands with two points keep their order.
bool are_tips_first(std::span<const StrandFile> files);

// Turns each strand round. All strands are turned, since one program stores all of its strands alike. Lists other than
// points are not turned.
void turn_round(std::span<StrandFile> files);

}  // namespace hairnet
