#include "client/viewer/sources/moment.hpp"

#include <utility>

namespace hairnet::viewer {

// The shown spans are copied, since they belong to the source until its next step.
Moment::Moment(const Pose& shown, const MovedLattice& lattice, std::shared_ptr<const LevelGeometry> geometry)
    : pose(shown),
      geometry_(std::move(geometry)),
      grid_(lattice.grid_displacements.begin(), lattice.grid_displacements.end()),
      basis_(lattice.basis),
      coefficients_(lattice.coefficients.begin(), lattice.coefficients.end()) {}

Moment::Moment(const link::Playout::Sample& sample) : Moment(sample.pose, sample.lattice(), sample.geometry()) {}

}  // namespace hairnet::viewer
