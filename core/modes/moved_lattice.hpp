#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/modes/basis.hpp"

namespace hairnet {

// A lattice that moves hair, at one moment.
struct MovedLattice {
  const LevelGeometry* geometry = nullptr;       // null: the hair is at rest
  std::span<const Vec3f> grid_displacements;     // every grid node, head space, m; empty: by the coefficients
  std::shared_ptr<const Basis> basis = nullptr;  // of the same geometry
  std::span<const float> coefficients = {};      // m, of the basis; those that are missing at the end are 0
};

// The displacements of every grid node, head space, m; none at rest. Those that follow from coefficients are computed
// into `scratch`.
std::span<const Vec3f> nodes_of(const MovedLattice& lattice, std::vector<Vec3f>& scratch);

}  // namespace hairnet
