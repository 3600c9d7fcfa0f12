#pragma once

#include <vector>

#include "core/build/node_shares.hpp"
#include "core/ffd/lattice.hpp"

namespace hairnet {

// The ether (section 3.2) and the masses that it completes, one entry an active node.
struct NodeMechanics {
  std::vector<double> mass;             // kg, hair and ether
  std::vector<double> ether_stiffness;  // N/m
  std::vector<double> ether_damping;    // N s/m
};

// Mass: the ether's total is a ratio of the hair's, shared equally, since each node stands for one cell.
//
// Stiffness: k_i = m_i (|g| / l_i + gel_i), gel_i the material's own ether stiffness. Hair without gel that hangs from
// its root stays exactly vertical at any tilt of the head if each node moves by l_i (d' - d), d and d' being the
// vertical in head axes at rest and now, l_i the node's depth below the root: the lattice interpolates that field
// exactly, since it is affine in depth, and with k_i l_i = m_i |g| each node is in balance by itself, so that springs
// carry nothing and truncated solving or merged springs change nothing. So l_i is the depth of the node (not of the
// hair around it, which at the tips lies higher), meant over the hair around it by mass, each piece from its own root
// and kHangLengthMin at least.
//
// Damping: q_i = 2 zeta_i sqrt(k_i m_i), a share of critical damping of the node's swing about its design, which is
// that of hair as a pendulum. Lengths, gel and ratios are means by mass; nodes with no hair take those of their
// neighbours, or of all.
NodeMechanics fill_ether(const LevelGeometry& geometry, const NodeShares& shares);

}  // namespace hairnet
