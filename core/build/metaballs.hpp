#pragma once

#include <span>
#include <vector>

#include "core/build/body_balls.hpp"
#include "core/build/level.hpp"

namespace hairnet {

// The body's balls made to measure for each node (section 3.3): a node outside the skin stays the hair's thickness off
// it, a node inside is kept from going further in. No radius reaches its node's place in the design, so that contact
// does nothing there. A ball that would be less than a third of its size is off for that node.
// Potentials: the material's, or as much as lets 5 m_i |g| in by 5 mm. `mass` in kg, one entry a node of `rest_head`.
std::vector<Metaball> fit_metaballs(const BodyShape& shape, std::span<const Vec3f> rest_head,
                                    std::span<const double> mass, const Material& material,
                                    const HairStencils& stencils = {});

}  // namespace hairnet
