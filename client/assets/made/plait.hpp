#pragma once

#include "client/assets/made/style.hpp"

namespace hairnet::made {

// All hair pulled back to the nape and plaited from there in three locks (group "plait"), knotted at every crossing. A
// cord is wound round the end, its own ends hanging (group "cord"); below it the tips are free.
void dress_plait(const StyleOptions& options, Groom& groom);

}  // namespace hairnet::made
