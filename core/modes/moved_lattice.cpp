#include "core/modes/moved_lattice.hpp"

namespace hairnet {

std::span<const Vec3f> nodes_of(const MovedLattice& lattice, std::vector<Vec3f>& scratch) {
  if (lattice.geometry == nullptr || !lattice.basis) return lattice.grid_displacements;
  std::vector<Vec3f> active(lattice.basis->node_count);
  displacements_of(*lattice.basis, lattice.coefficients, active);
  scratch.resize(lattice.geometry->lattice.node_count());
  expand_displacements(*lattice.geometry, active, scratch);
  return scratch;
}

}  // namespace hairnet
