#pragma once

#include "client/assets/made/growth.hpp"
#include "client/assets/made/recipe.hpp"

namespace hairnet::made {

// The random differences between one strand and its neighbours. The caller draws the random numbers, so that the growth
// of a strand is a function of its arguments.
struct StrandVariation {
  double length_m = 0;
  // From 0, nearest to the skin, to 1, outermost.
  double layer = 0.5;
  // The strand's random deviation, which is added to the preferred direction.
  Vec3 stray = Vec3::Zero();
  bool fringe = false;
};

// The growth of a strand from `root` under the recipe, which must outlive the result.
Growth growth_of(const LooseRecipe& recipe, const Root& root, const StrandVariation& variation);

// Whether the strand falls in front of the shoulders, and not behind them. The answer depends on the root alone, so
// that neighbours stay together.
bool falls_to_chest(const LooseRecipe& recipe, const Root& root);

// Whether a strand from this root belongs to the fringe.
bool in_fringe(const LooseRecipe& recipe, const Root& root);

// The azimuth of the root without its side: 0 in front, 180 behind.
double degrees_from_front(const Root& root);

}  // namespace hairnet::made
