#pragma once

#include "client/assets/made/style.hpp"

namespace hairnet::made {

// Adds a veil of tulle, pinned by a comb across the crown and falling over hair, shoulders and back (group "veil"). The
// hair must be complete. Cloth comes after strands, threads and cards in the groom's list of points.
void add_veil(double length_m, Groom& groom);

}  // namespace hairnet::made
