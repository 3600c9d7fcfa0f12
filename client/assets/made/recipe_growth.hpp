#pragma once

#include "client/assets/made/growth.hpp"
#include "client/assets/made/recipe.hpp"

namespace hairnet::made {

// The random differences between one strand and its neighbours.
struct StrandVariation {
  double length_m = 0;
  double layer = 0.5;         // 0 nearest to the skin … 1 outermost
  Vec3 stray = Vec3::Zero();  // added to its preferred direction
  bool fringe = false;
};

// The growth of a strand from `root` under the recipe, which must outlive the result.
Growth growth_of(const LooseRecipe& recipe, const Root& root, const StrandVariation& variation);

// Whether it falls in front of the shoulders, not behind them.
bool falls_to_chest(const LooseRecipe& recipe, const Root& root);

bool in_fringe(const LooseRecipe& recipe, const Root& root);

double degrees_from_front(const Root& root);

}  // namespace hairnet::made
