#pragma once

#include "client/assets/made/growth.hpp"
#include "client/assets/made/recipe.hpp"

namespace hairnet::made {

// The random differences between one strand and its neighbours.
struct StrandVariation {
  double length_m = 0;
  double layer = 0.5;         // 0 nearest to the skin … 1 outermost
  Vec3 stray = Vec3::Zero();  // added to where it wants to go
  bool fringe = false;
};

// How a strand from `root` grows under the recipe, which must outlive the result.
Growth growth_of(const LooseRecipe& recipe, const Root& root, const StrandVariation& variation);

// Before the shoulders rather than behind them.
bool falls_to_chest(const LooseRecipe& recipe, const Root& root);

bool in_fringe(const LooseRecipe& recipe, const Root& root);

double degrees_from_front(const Root& root);

}  // namespace hairnet::made
