#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "tests/bench/baseline_step.hpp"

// What both baselines share: the forces of reference_step.cpp, and the blocks of its matrix, passed one by one to the
// code that assembles them. Only for the library of the baselines.
namespace hairnet::bench {

using NodeVectors = Eigen::Map<Eigen::Matrix3Xd>;

// A stiffener's part of A = M - h df/dp' - h^2 df/dp is w_i w_j block for all pairs of its nodes.
struct StiffenerBlock {
  const PlainStiffeners* stiffeners;
  std::size_t index;
  Eigen::Matrix3d block;
};

struct BaselineSystem {
  // The rest positions of the nodes in the world at the end of the step, R P^0, and their velocities R' P^0.
  Eigen::Matrix3Xd rest, rest_dot;
  // The right side of the system, h (f + h df/dp P').
  Eigen::VectorXd load;
  // One block for each node, of mass, ether, drag and contact.
  std::vector<Eigen::Matrix3d> node_blocks;
  std::vector<StiffenerBlock> springs, attachments;
};

void compute_system(const PlainLevel& level, const PlainInput& input, const NodeVectors& P, const NodeVectors& P_dot,
                    BaselineSystem& system);

// P' += dP', P += h P'. False when the result is not finite.
bool advance(double step_s, const Eigen::VectorXd& dP_dot, NodeVectors& P, NodeVectors& P_dot);

}  // namespace hairnet::bench
