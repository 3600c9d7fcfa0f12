#pragma once

#include <cstdint>

#include "core/random.hpp"

namespace hairnet::made {

// The random differences between seeds: a phase, and the size and tempo of the person's movements. The ranges are
// small, so that each seed still shows the motion that its name says.
struct MotionVariation {
  explicit MotionVariation(std::uint32_t seed) {
    // The second number is a stream of the seed that only motions use.
    Random random(seed, 7);
    phase = random.unit();
    size = random.between(0.9, 1.1);
    tempo = random.between(0.93, 1.07);
  }
  double phase, size, tempo;
};

}  // namespace hairnet::made
