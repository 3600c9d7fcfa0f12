#pragma once

#include <cstdint>

#include "core/random.hpp"

namespace hairnet::made {

// What differs from one seed to the next: a phase, and how large and fast the person moves.
struct Temper {
  explicit Temper(std::uint32_t seed) {
    Random random(seed, 7);
    phase = random.unit();
    size = random.between(0.9, 1.1);
    pace = random.between(0.93, 1.07);
  }
  double phase, size, pace;
};

}  // namespace hairnet::made
