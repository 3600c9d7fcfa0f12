#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/build/grid.hpp"
#include "core/groom/groom.hpp"
#include "core/groom/material.hpp"

namespace hairnet {

// What the hair gives to each grid node: the integral along the strands of its trilinear weight times a density. It is
// exact (each piece lies in one cell, where the weight is a cubic along it), so that sums over the nodes are the hair's
// own, and it does not depend on how finely the polyline was drawn: curls keep their arc length.
struct NodeShares {
  explicit NodeShares(std::size_t node_count)
      : mass(node_count),
        drag(node_count),
        hang_moment(node_count),
        gel_moment(node_count),
        ether_damping_moment(node_count),
        touched(node_count) {}
  std::vector<double> mass;                 // kg, hair alone
  std::vector<std::array<double, 6>> drag;  // eq. 6: xx xy xz yy yz zz, N s/m
  // Mass times hanging length (kg m), times the material's ether stiffness (kg/s^2), and times its ether damping ratio
  // (kg).
  std::vector<double> hang_moment, gel_moment, ether_damping_moment;
  double ether_mass = 0;      // kg, of the whole groom: shared by volume, not by where the hair is
  std::vector<bool> touched;  // some piece of hair has a weight on the node
};

// The node hangs on the roots of the hair around it, this far below them (see ether.hpp); hair beside or above its root
// stands as if it hung by kHangLengthMin.
inline constexpr double kHangLengthMin = 0.015;  // m

// Adds hair or fabric that weighs `mass` (kg) on the node and hangs `hang_length` (m) below its root, in the ether of
// `material`.
void add_mass(std::uint32_t node, double mass, double hang_length, const Material& material, NodeShares& shares);

// Adds one strand. `polyline` in grid coordinates, without repeated points; its nodes are touched even if it is a
// point.
void add_strand_shares(const Grid& grid, std::span<const Vec3> polyline, const StrandProperties& strand,
                       const Material& material, NodeShares& shares);

}  // namespace hairnet
