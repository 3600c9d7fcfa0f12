#pragma once

#include <cstddef>

#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet {

// Adds rooted strands between those of the groom, its guides, until there are `strand_count`. Their roots lie evenly
// over the skin that the guides' roots cover. Each new strand is the mean of up to three guides about its root, in the
// proportions of their nearness, turned with the skin from their roots to its own; a guide that leads elsewhere than
// the nearest, as on the other side of a parting, has no part in it. It takes the nearest guide's properties, and all
// strands share the guides' hairs. The same groom gives the same bits. Returns an error for a groom with fewer than 3
// rooted guides, with other things than strands, or with `strand_count` strands or more. On an error the groom is
// unchanged.
Result<void> fill_strands(std::size_t strand_count, Groom& groom);

}  // namespace hairnet
