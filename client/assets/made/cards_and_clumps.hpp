#pragma once

#include "core/groom/groom.hpp"

namespace hairnet::made {

// Hair in fewer, larger pieces.

// Each strand becomes a card across the way that the head faces there, `width_m` wide where it is widest.
void turn_into_cards(double width_m, Groom& groom);

// Each strand becomes a lock of itself and `copy_count` copies.
void turn_into_clumps(std::uint16_t copy_count, double radius_m, Groom& groom);

}  // namespace hairnet::made
