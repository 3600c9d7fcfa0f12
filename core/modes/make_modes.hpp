#pragma once

#include <memory>

#include "core/levels/build.hpp"
#include "core/modes/basis.hpp"
#include "core/modes/mode_map.hpp"
#include "core/modes/snapshots.hpp"

namespace hairnet {

// A basis of the shapes of a groom's hair, and for each level with a lattice the map from its displacements to
// coefficients of this basis. Immutable.
struct Modes {
  Basis basis;
  // The map of each level with a lattice, from its displacements to coefficients.
  std::array<ModeMap, 4> maps;
  // Entry n is the error of the first n + 1 coefficients, over the motion. It is a mean over motions that a first basis
  // was not made from. This basis is made from those motions as well, so it errs a little less.
  std::vector<float> validation_error;

  [[nodiscard]] const ModeMap& map(LevelIndex level) const { return maps[static_cast<std::size_t>(level)]; }
  // The fewest first coefficients whose validation error is at most `error`; 0: not even all have it.
  [[nodiscard]] std::size_t count_within(float error) const;
};

// Steps all levels through training motions side by side. The basis has the shapes that span most of what the finest
// level did: the leading eigenvectors of its snapshots' covariance, in the hair's metric. It has as many as a basis of
// two thirds of the motions needs for `error_max` on the other third: a multiple of 16, from 32 to kModeCountMax, but
// not more than there are snapshots. The finest level's map projects; each other map is the linear map from that
// level's snapshots that comes nearest to the finest level's coefficients (ridge regression), so coarse levels move as
// the finest does on the mean. The result has the same bits for any `parallel_for`. Null only when cancelled.
std::shared_ptr<const Modes> make_modes(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                        const BuildCallbacks& callbacks = {}, const ParallelFor& parallel_for = {},
                                        const ModeTraining& training = {});

}  // namespace hairnet
