#pragma once

#include "client/assets/made/style.hpp"

namespace hairnet::made {

// Pulls all hair back to the nape and plaits it from there in three locks (group "plait"), knotted at every crossing. A
// cord is wound round the end, with hanging ends (group "cord"); below it the tips are free. Strands are rooted and run
// through the whole plait, so that the mechanics need only the knots.
void dress_plait(const StyleOptions& options, Groom& groom);

}  // namespace hairnet::made
