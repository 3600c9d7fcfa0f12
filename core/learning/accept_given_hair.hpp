#pragma once

#include <memory>

#include "core/groom/groom.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "core/result.hpp"

namespace hairnet {

// Takes over hair of this groom that was learnt elsewhere, on another build's basis: fits its outputs to this basis, in
// a fifth of the time that learning takes, and measures it. The hair keeps the ranges of inputs and of wind that it was
// given with. `given` must pass validate(). Null when cancelled. Refused as learn_hair() refuses. The same bits for any
// `parallel_for`.
Result<std::shared_ptr<const LearntHair>> accept_given_hair(const Groom& groom,
                                                            const std::shared_ptr<const LevelSet>& levels,
                                                            const Modes& modes, const LearntHair& given,
                                                            const BuildCallbacks& callbacks = {},
                                                            const ParallelFor& parallel_for = {});

}  // namespace hairnet
