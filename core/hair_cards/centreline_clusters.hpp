#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/hair_cards/strand_centrelines.hpp"

namespace hairnet {

// Groups centrelines that begin near each other and go the same way: k-means on their outlines. Gives at most
// `count` clusters, none of them empty, as indices into `centrelines`; each of `members` is in exactly one. Asserts
// that the members exist.
std::vector<std::vector<std::uint32_t>> cluster_centrelines(std::span<const Centreline> centrelines,
                                                            std::span<const std::uint32_t> members, std::size_t count);

}  // namespace hairnet
