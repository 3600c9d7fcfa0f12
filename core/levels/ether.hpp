#pragma once

#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/levels/lumped_hair.hpp"

namespace hairnet {

// Mass and ether (section 3.2) of each active node.
struct NodeMechanics {
  // The mass of each node, with hair and ether, kg.
  std::vector<double> mass;
  std::vector<double> ether_stiffness;  // N/m
  std::vector<double> ether_damping;    // N s/m
};

// Mass: the ether's total is a ratio of the hair's mass. All nodes get equal shares, since each node stands for one
// cell.
//
// Stiffness: k_i = m_i (|g| / l_i + gel_i), where gel_i is the material's own ether stiffness and l_i the depth of the
// node below the roots. With d and d' the vertical in head axes at rest and now, hair without gel hangs vertically at
// any tilt of the head if each node moves by l_i (d' - d). The lattice can represent this field exactly because it is
// affine in depth. Since k_i l_i = m_i |g|, each node is then in balance by itself: springs carry no load, so truncated
// solving and merged springs do not change the shape. l_i is measured from the root of each piece of hair around the
// node down to the node itself, not to the piece, which lies higher at the tips; it is the mean of these by mass, and
// at least kHangLengthMin.
//
// Damping: q_i = 2 zeta_i sqrt(k_i m_i), a fraction of the critical damping of the node's oscillation about its
// design position, in which the hair is a pendulum. Lengths, gel and ratios are averaged by mass. Nodes without
// hair take the values of their neighbours, or the average of all nodes. Asserts that `lumped` has the nodes of
// `geometry`.
NodeMechanics fill_ether(const LevelGeometry& geometry, const LumpedHair& lumped);

}  // namespace hairnet
