#pragma once

#include "client/assets/made/recipe.hpp"
#include "client/assets/made/style.hpp"

namespace hairnet::made {

// Adds strands that fall free from the scalp to a groom that has its body. The cost is linear in strands times locks.
// The same options give the same strands.
void dress_loose(const LooseRecipe& recipe, const StyleOptions& options, Groom& groom);

}  // namespace hairnet::made
