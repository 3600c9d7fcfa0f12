#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/modes/basis.hpp"

namespace hairnet {

// A lattice that moves hair, at one moment. It owns neither nodes nor coefficients; they must outlive it.
struct MovedLattice {
  // Null means that the hair is at rest.
  const LevelGeometry* geometry = nullptr;
  // The displacement of every grid node in head space, m. Empty means that the coefficients move the lattice.
  std::span<const Vec3f> grid_displacements;
  // The basis of the coefficients; it was made for this geometry.
  std::shared_ptr<const Basis> basis = nullptr;
  // The first coefficients of the basis, m; those that are missing are 0.
  std::span<const float> coefficients = {};
};

// The displacements of every grid node, head space, m; none at rest. Those that follow from coefficients are computed
// into `scratch`.
std::span<const Vec3f> nodes_of(const MovedLattice& lattice, std::vector<Vec3f>& scratch);

}  // namespace hairnet
