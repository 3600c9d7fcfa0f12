#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/random.hpp"

namespace hairnet {

// Lattices and vectors for tests, the same for the same seed on every machine.
class WebRandom {
 public:
  explicit WebRandom(std::uint64_t seed) : random_(seed) {}

  // From -most to most.
  float real(float most);
  Vec3f vector(float most);
  std::vector<Vec3f> vectors(std::size_t count, float most);
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(random_.next() % count); }
  // About two in three nodes are active, and each of the others follows one to three of them.
  LevelGeometry geometry(const std::array<int, 3>& dims);
  // A grid of 5 x 5 x 5 that contains most of the points.
  LevelGeometry geometry_around(std::span<const Vec3f> points);

 private:
  Random random_;
};

}  // namespace hairnet
