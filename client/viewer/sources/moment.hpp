#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "client/link/lattice_blend.hpp"
#include "core/levels/level.hpp"
#include "core/pose/pose.hpp"

namespace hairnet::viewer {

// The hair of one played sample.
struct Shape {
  LevelIndex level = LevelIndex::rigid;
  std::int64_t time_ns = 0;
  std::vector<Vec3f> displacement;                // active order, head space, m; empty = rigid
  std::shared_ptr<const LevelGeometry> geometry;  // of the displacement
};

// The state of one character at one moment, copied so that drawing can wait until the stream has ended.
struct Moment {
  Pose pose;
  Shape shape;
  std::vector<Shape> trail;  // the lattices to blend from, in order of time: before and after each level switch
};

// Feeds a new blend with the samples before the moment, so that it has the same layers as a window would have had.
void replay(const Moment& moment, link::LatticeBlend& blend);

}  // namespace hairnet::viewer
