#pragma once

#include <Eigen/Core>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"

namespace hairnet {

// G of a level: d^T G d, summed over x, y and z, is the mean square of the distances that the hair's points move when
// the active nodes move by d. Nodes that move no point have a small weight of their own, so G is positive definite.
// Lattices have nodes that no hair is near. Modes that are orthonormal in G and not in the nodes make a coefficient a
// distance of hair in metres, so leaving coefficients out or rounding them errs by what they were.
Eigen::MatrixXf hair_metric(const Groom& groom, const Level& level);

}  // namespace hairnet
