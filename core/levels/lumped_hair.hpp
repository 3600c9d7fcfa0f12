#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/groom/material.hpp"
#include "core/levels/grid.hpp"

namespace hairnet {

// The hair's mass, drag and hanging length lumped onto the grid nodes: the integral along the strands of trilinear
// weight times density. The integral is exact, since each piece lies in one cell where the weight is a cubic along the
// piece. So sums over all nodes equal those of the hair, and the number of points in a polyline does not matter.
struct LumpedHair {
  explicit LumpedHair(std::size_t node_count)
      : mass(node_count),
        drag(node_count),
        hang_moment(node_count),
        gel_moment(node_count),
        ether_damping_moment(node_count),
        touched(node_count) {}
  // The mass of the hair alone, without ether, kg.
  std::vector<double> mass;
  // The drag matrix of eq. 6 as xx xy xz yy yz zz, N s/m.
  std::vector<std::array<double, 6>> drag;
  // Mass times hanging length (kg m), times the material's ether stiffness (kg/s^2), and times its ether damping ratio
  // (kg).
  std::vector<double> hang_moment, gel_moment, ether_damping_moment;
  // The mass of the ether of the whole groom, kg. It is shared by volume, not by where the hair is.
  double ether_mass = 0;
  // Whether a piece of hair has a weight on the node.
  std::vector<bool> touched;
};

// The smallest hanging length of a node; the hanging length is the node's depth below the roots of the hair around it
// (ether.hpp). Hair beside or above its root uses this value.
inline constexpr double kHangLengthMin = 0.015;  // m

// Adds hair or fabric that weighs `mass` (kg) on the node and hangs `hang_length` (m) below its root, in the ether of
// `material`. Asserts that the mass is not negative.
void add_mass(std::uint32_t node, double mass, double hang_length, const Material& material, LumpedHair& lumped);

// Adds one strand. `polyline` is in grid coordinates; its nodes are touched even if it is a single point. Asserts that
// no point repeats the one before, and that `lumped` has the nodes of `grid`.
void lump_strand(const Grid& grid, std::span<const Vec3> polyline, const StrandProperties& strand,
                 const Material& material, LumpedHair& lumped);

}  // namespace hairnet
