#pragma once

#include <memory>

#include "core/groom/groom.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "core/result.hpp"

namespace hairnet {

// How a groom's hair is learnt. Counts of motions are rounded up to whole thirty-twos; half of each is in wind.
struct HairLearning {
  // The number of motions from which the network learns.
  std::uint32_t motion_count = 1024;
  // How many more motions only measure the error.
  std::uint32_t validation_count = 32;
  // The duration of each motion, s.
  double duration_s = 6;
  // The number of hidden numbers of the network, a multiple of 4.
  std::size_t hidden_count = 48;
  // The number of modes that the network drives, a multiple of 4; fewer when the basis has fewer.
  std::size_t mode_count = 32;
  // How often descent goes over all motions.
  int rounds = 20;
  // Errors are propagated back through this time, s.
  double window_s = 1;
  // The learning rate of the first steps, which falls to a hundredth.
  double rate = 0.01;
  // The weight decay, relative to the rate.
  double decay = 0.3;
};

// Learns the hair of a groom as it was built: steps the finest level through training motions, and fits a network to
// its coefficients. Null when cancelled. Refused when the network errs more from the finest level, in motions that it
// was not fitted to, than the low level does; where it does so in wind alone, it is not for wind. The same bits for any
// `parallel_for`.
Result<std::shared_ptr<const LearntHair>> learn_hair(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                                     const Modes& modes, const BuildCallbacks& callbacks = {},
                                                     const ParallelFor& parallel_for = {},
                                                     const HairLearning& learning = {});

}  // namespace hairnet
