#pragma once

#include <span>
#include <vector>

#include "core/build/body_balls.hpp"
#include "core/build/level.hpp"
#include "core/parallel_for.hpp"

namespace hairnet {

// The body's balls made to measure for each node (section 3.3): a node inside the skin is kept from going further in; a
// node outside may come in until the hair that it moves, all nodes together, meets the skin, or the node itself is the
// hair's thickness off it. No radius reaches its node's place in the design, so that contact does nothing there. A ball
// that would be less than a third of its size is off for that node.
// Potentials: the material's, or as much as lets 5 m_i |g| in by 5 mm. `stencils` of `shape.hair`; `mass` in kg, one
// entry a node of `rest_head`.
std::vector<Metaball> fit_metaballs(const BodyShape& shape, const HairStencils& stencils,
                                    std::span<const Vec3f> rest_head, std::span<const double> mass,
                                    const Material& material, const ParallelFor& parallel_for = {});

}  // namespace hairnet
