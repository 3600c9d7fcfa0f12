#pragma once

#include <cstddef>

#include "core/groom/groom.hpp"

namespace hairnet {

// Strips that stand for all strands and strips of the groom, for drawing it far away: each for a cluster of those that
// run side by side, of one group, and either all rooted or none. Along the cluster's mean, as long as its members hang,
// as wide as they and their curls spread, its sides where they spread most or else along the surface of the hair, and
// outside the body. 12 pairs of points each, closer where it bends. What has no length is in no strip.
// `count`: how many, 0 (none) to 4096; there are more only when there are more kinds of hair (group, rooted or not),
// and fewer when there are fewer strands. The groom must be sound; the same one gives the same bits. Takes some 0.2 s
// for 10 000 strands. Any thread.
FarStrips make_far_strips(const Groom& groom, std::size_t count);

// As many as its hair deserves: up to 400, fewer of few strands, none without hair.
std::size_t far_strip_count_for(const Groom& groom);

}  // namespace hairnet
