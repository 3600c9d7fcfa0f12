#pragma once

#include <functional>
#include <memory>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"
#include "core/parallel_for.hpp"

namespace hairnet {

// Makes the distance field of each bone's skin that hair can reach. A triangle counts for a bone that has a large part
// of its weights. The same bits for any `parallel_for`. Asserts that each vertex of the body has bone weights. Asks
// `keep_going`, from any thread, for each row of a field; returns null when the answer was no.
std::shared_ptr<const Skin> make_skin(const Groom& groom, const ParallelFor& parallel_for = {},
                                      const std::function<bool()>& keep_going = {});

// The signed distance at a point (head space at rest, m): trilinear inside the grid; outside it, the value at the
// nearest point of the grid plus the distance to that point. `gradient` may be null; its length is about 1. Asserts
// that the field has cells.
double skin_distance(const SkinDistanceField& field, const Vec3& point, Vec3* gradient = nullptr);

}  // namespace hairnet
