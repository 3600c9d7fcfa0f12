#pragma once

#include "core/build/level.hpp"
#include "core/groom/groom.hpp"
#include "core/parallel_for.hpp"

namespace hairnet {

// The skin of each bone that hair can come near: of the triangles that mostly follow the bone, within reach of the
// hair. Deterministic for any `parallel_for`.
std::shared_ptr<const Skin> make_skin(const Groom& groom, const ParallelFor& parallel_for = {});

// The signed distance at a point (head space at rest, m), trilinear within the grid; outside it, the nearest value of
// the grid and the way to there. `gradient`, when asked for, has about unit length.
double skin_distance(const SkinField& field, const Vec3& point, Vec3* gradient = nullptr);

}  // namespace hairnet
