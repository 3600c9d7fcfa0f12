#pragma once

#include <functional>
#include <memory>

#include "core/groom/groom.hpp"
#include "core/parallel_for.hpp"
#include "core/skin/skin_distance_field.hpp"

namespace hairnet {

// Makes the distance field of each bone's skin that hair can reach. A triangle counts for a bone that has a large
// part of its weights. The same bits for any `parallel_for`. Asserts that each vertex of the body has bone weights.
// Asks `keep_going`, from any thread, for each row of a field; returns null when the answer was no.
std::shared_ptr<const Skin> make_skin(const Groom& groom, const ParallelFor& parallel_for = {},
                                      const std::function<bool()>& keep_going = {});

}  // namespace hairnet
