#pragma once

#include <span>

#include "core/ffd/lattice.hpp"

namespace hairnet {

// A lattice that moves hair, at one moment.
struct MovedLattice {
  const LevelGeometry* geometry = nullptr;    // null: the hair is at rest
  std::span<const Vec3f> grid_displacements;  // every grid node, head space, m
};

}  // namespace hairnet
