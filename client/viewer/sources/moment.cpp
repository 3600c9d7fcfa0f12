#include "client/viewer/sources/moment.hpp"

#include <utility>

namespace hairnet::viewer {

MovedLattice lattice_of(const link::Playout::Sample& sample) {
  if (!sample.basis) return {};
  const wire::HairBasis& hair = sample.basis->hair;
  return {&hair.geometry, {}, {sample.basis, &hair.basis}, sample.coefficients};
}

Moment::Moment(const Pose& shown, const MovedLattice& lattice, std::shared_ptr<const LevelGeometry> geometry)
    : pose(shown),
      geometry_(std::move(geometry)),
      grid_(lattice.grid_displacements.begin(), lattice.grid_displacements.end()),
      basis_(lattice.basis),
      coefficients_(lattice.coefficients.begin(), lattice.coefficients.end()) {}

Moment::Moment(const link::Playout::Sample& sample) : Moment(sample.pose, lattice_of(sample), sample.geometry()) {}

}  // namespace hairnet::viewer
