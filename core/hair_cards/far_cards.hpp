#pragma once

#include <cstddef>

#include "core/groom/groom.hpp"

namespace hairnet {

// Makes hair cards that replace all strands and cards of the groom when it is drawn from far away. Each card stands
// for a cluster of strands that run side by side and belong to one group; either all of them are rooted or none. The
// card follows the mean of the cluster, is as long as its strands hang and as wide as they and their curls spread. Its
// width runs where the strands spread most, or else along the surface of the hair. It lies outside the body. It has 12
// pairs of points, closer where it bends. Strands without length are left out. Asserts that `count` is at most
// GroomLimits::far_card_count_max; 0 gives none. The result has more cards only when there are more kinds of hair
// (group, rooted or not), and fewer when there are fewer strands. `groom` must pass validate(). The same groom gives
// the same bits. Takes about 0.2 s for 10 000 strands. Any thread may call it.
FarCards make_far_cards(const Groom& groom, std::size_t count);

// The default number of cards for a groom: at most 400, fewer for few strands, 0 without hair.
std::size_t far_card_count_for(const Groom& groom);

}  // namespace hairnet
