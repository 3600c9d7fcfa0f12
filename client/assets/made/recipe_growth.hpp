#pragma once

#include "client/assets/made/growth.hpp"
#include "client/assets/made/recipe.hpp"

namespace hairnet::made {

// The random differences between one strand and its neighbours. The caller draws them, so that one strand's growth is a
// function of its arguments.
struct StrandVariation {
  double length_m = 0;
  // Ranges from 0, nearest to the skin, to 1, outermost.
  double layer = 0.5;
  // It is added to the preferred direction.
  Vec3 stray = Vec3::Zero();
  bool fringe = false;
};

// The growth of a strand from `root` under the recipe, which must outlive the result.
Growth growth_of(const LooseRecipe& recipe, const Root& root, const StrandVariation& variation);

// Whether it falls in front of the shoulders, not behind them. The answer depends on the root alone, so that neighbours
// stay together.
bool falls_to_chest(const LooseRecipe& recipe, const Root& root);

bool in_fringe(const LooseRecipe& recipe, const Root& root);

double degrees_from_front(const Root& root);

}  // namespace hairnet::made
