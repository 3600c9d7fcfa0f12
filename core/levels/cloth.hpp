#pragma once

#include <span>

#include "core/groom/fabric.hpp"
#include "core/levels/lumped_hair.hpp"
#include "core/levels/stiffener_list.hpp"

namespace hairnet {

// Adds cloth to the lattice (paper 5.2). Each edge of its mesh is a spring, cut at lattice planes like hair, and each
// quad without a diagonal in the mesh gets one. Along the weave an edge of length L represents the width (A1 + A2) /
// L of cloth, where A1 and A2 are its triangles' areas: k = S (A1 + A2) / L^2 with the stretch stiffness S. Diagonals
// have k = 2 G (A1 + A2) / L^2, so that the two of a square resist shear with the modulus G. Pinned points get
// attachments. `points_head`: all points of the groom. `group`: of the stiffeners. Asserts that the cloth's points
// exist, and that all or none of them have a distance to the pins.
void add_cloth(const Grid& grid, std::span<const Vec3f> points_head, const Cloth& cloth, std::uint16_t group,
               StiffenerList& springs, StiffenerList& attachments);

// Adds the cloth's mass (by area) and its drag (Q = q A n n^T, across the plane), integrated over the triangles.
// Hanging lengths count from the highest pinned point, or from the highest point when none is pinned. Asserts that the
// cloth has points, and that `lumped` has the nodes of `grid`.
void lump_cloth(const Grid& grid, std::span<const Vec3f> points_head, const Cloth& cloth, const Material& material,
                LumpedHair& lumped);

}  // namespace hairnet
