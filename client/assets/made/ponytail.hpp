#pragma once

#include "client/assets/made/style.hpp"

namespace hairnet::made {

// Pulls all hair back to a band behind the crown (group "pulled"); from there the tail falls (group "tail", its strands
// start in mid-air). The band is cloth, tied to both by a knot, with a bow on it. Two fifths of the strands are the
// tail. They begin in the band and have no root on the skull.
void dress_ponytail(const StyleOptions& options, Groom& groom);

}  // namespace hairnet::made
