#include "client/viewer/sources/moment.hpp"

#include "core/assert.hpp"

namespace hairnet::viewer {

void ShownLattice::show(std::span<const Vec3f> displacement, const std::shared_ptr<const LevelGeometry>& geometry) {
  geometry_ = displacement.empty() ? nullptr : geometry;
  if (!geometry_) return;
  HAIRNET_ASSERT(displacement.size() == geometry_->active_nodes.size());
  grid_.resize(geometry_->lattice.node_count());
  expand_displacements(*geometry_, displacement, grid_);
}

}  // namespace hairnet::viewer
