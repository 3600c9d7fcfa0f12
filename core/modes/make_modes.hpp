#pragma once

#include <memory>

#include "core/levels/build.hpp"
#include "core/modes/basis.hpp"
#include "core/modes/mode_map.hpp"
#include "core/modes/snapshots.hpp"

namespace hairnet {

// What the levels of a groom say about its hair, in the same terms. Immutable.
struct Modes {
  Basis basis;
  std::array<ModeMap, 4> maps;  // of each level with a lattice

  [[nodiscard]] const ModeMap& map(LevelIndex level) const { return maps[static_cast<std::size_t>(level)]; }
};

// Steps all levels through training motions side by side. The basis has the shapes that span most of what the finest
// level did: the leading eigenvectors of its snapshots' covariance, in the hair's metric. The finest level's map
// projects; each other map is the linear map from that level's snapshots that comes nearest to the finest level's
// coefficients (ridge regression), so coarse levels move as the finest does on the mean. The result has the same bits
// for any `parallel_for`. Null only when cancelled.
std::shared_ptr<const Modes> make_modes(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                        const BuildCallbacks& callbacks = {}, const ParallelFor& parallel_for = {},
                                        const ModeTraining& training = {});

}  // namespace hairnet
