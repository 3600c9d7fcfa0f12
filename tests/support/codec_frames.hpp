#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/levels/level.hpp"
#include "core/random.hpp"
#include "schema/codec/frame_codec.hpp"

namespace hairnet::codec {

// Frames for tests: any integers at all, or those of a lattice that the solver moves.
class RandomFrames {
 public:
  explicit RandomFrames(std::uint64_t seed) : random_(seed) {}

  std::size_t below(std::size_t count) { return static_cast<std::size_t>(random_.next() % count); }
  // A grid of 2 to 6 nodes an axis, some of them active: at least one.
  LevelGeometry geometry();
  static LevelGeometry full_grid(const std::array<int, 3>& dims);
  // Integers of at most `bits` bits; bones of any size.
  FrameIntegers frame(std::size_t node_count, int bits, bool velocities);

 private:
  Random random_;
};

struct MovingLattice {
  LevelGeometry geometry;
  std::vector<Pose> poses;                        // a tick each
  std::vector<std::vector<Vec3f>> displacements;  // of active nodes, m
  std::vector<std::vector<Vec3f>> velocities;     // m/s
};
// A made hairstyle through a made motion, after a second of it.
MovingLattice step_made_lattice(LevelIndex level, double rate_hz, std::size_t tick_count);

std::vector<FrameIntegers> quantised(const MovingLattice& moving, ErrorClass error_class, bool velocities);

}  // namespace hairnet::codec
