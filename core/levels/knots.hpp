#pragma once

#include <span>

#include "core/groom/fabric.hpp"
#include "core/levels/lumped_hair.hpp"
#include "core/levels/stiffener_list.hpp"

namespace hairnet {

// A knot on the lattice is a small rigid truss. Its joints are up to kKnotJointsMax of the tied points, as far apart as
// possible (points at one place of a lattice cannot separate), and four corners of a tetrahedron about their mean, half
// a knot's extent away. Without these corners, points in a plane or on a line could shear past each other. A spring
// joins each two joints. All of them act between two points of the lattice, so they exert no force on the knot as a
// whole. Each has k = stiffness / (joints - 1). Asserts that the knot ties points.
inline constexpr std::size_t kKnotJointsMax = 6;
void add_knot(const Grid& grid, std::span<const Vec3f> points_head, const Knot& knot, std::uint16_t group,
              StiffenerList& ties);

// Adds the knot's own mass to the nodes around its mean point. The knot hangs like the hair there, so all hair must
// already be in `lumped`.
void add_knot_mass(const Grid& grid, std::span<const Vec3f> points_head, const Knot& knot, const Material& material,
                   LumpedHair& lumped);

}  // namespace hairnet
