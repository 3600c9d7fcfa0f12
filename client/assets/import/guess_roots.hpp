#pragma once

#include <span>

#include "client/assets/import/placement.hpp"

namespace hairnet {

// Whether the strands are stored tip first. Roots lie on the shell of a skull with no hair inside; tips do not. Both
// ends are compared; where neither is clearly the better scalp, the first points are the roots, as formats have them.
bool are_tips_first(std::span<const StrandFile> files);

// Turns each strand round.
void turn_round(std::span<StrandFile> files);

}  // namespace hairnet
