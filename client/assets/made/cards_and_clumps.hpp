#pragma once

#include "core/groom/groom.hpp"

namespace hairnet::made {

// Replaces strands by fewer, larger pieces.

// Turns each strand into a card across the head's normal there, `width_m` wide at its widest place. Each strand needs
// at least two points. Only the name, groups, root blends and the body stay, so other things are added afterwards.
void turn_into_cards(double width_m, Groom& groom);

// Turns each strand into a lock of itself and `copy_count` copies. The strands stay as they are: a clump only says how
// they are drawn. The radius at the tip is half of `radius_m`.
void turn_into_clumps(std::uint16_t copy_count, double radius_m, Groom& groom);

}  // namespace hairnet::made
