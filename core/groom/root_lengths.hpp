#pragma once

#include <cstdint>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet {

// The root length of a strand, lambda_0 of eq. 7, says how far from its root hair follows the skull: about this far out
// it is free to move with the lattice.

// Hair rooted near `centre` has another root length than other hair; the transition is smooth.
struct RootLengthRegion {
  // The centre in head space, m.
  Vec3f centre = Vec3f::Zero();
  // There is no influence beyond this distance.
  float radius_m = 0.05f;
  // The length at the centre.
  float root_length_m = 0.02f;
};

// The root lengths of the hair of a whole head.
struct RootLengths {
  // The length outside all regions.
  float root_length_m = 0.02f;
  std::vector<RootLengthRegion> regions;
  // The root length of each strand is at random up to this share longer or shorter, 0 to 0.95.
  float spread = 0;
  std::uint32_t seed = 1;
};

// The root length for hair with its root at this point, before the spread. Where regions overlap, each counts by how
// near its centre is.
float root_length_at(const RootLengths& lengths, const Vec3f& root_head);

// Sets the root length of every rooted strand of `group` (kEveryGroup: all groups) from the position of its root. The
// same seed gives the same bits, and a strand's random factor does not depend on the choice of groups.
inline constexpr int kEveryGroup = -1;
void set_root_lengths(const RootLengths& lengths, int group, Groom& groom);

}  // namespace hairnet
