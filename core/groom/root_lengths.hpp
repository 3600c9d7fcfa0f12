#pragma once

#include <cstdint>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet {

// Hair rooted near `centre` has another root length than other hair; the transition is smooth.
struct RootLengthRegion {
  // Is in head space, m.
  Vec3f centre = Vec3f::Zero();
  // There is no influence beyond this distance.
  float radius_m = 0.05f;
  // Is the length at the centre.
  float root_length_m = 0.02f;
};

// lambda_0 of eq. 7 over a head.
struct RootLengths {
  // Is the length outside all regions.
  float root_length_m = 0.02f;
  std::vector<RootLengthRegion> regions;
  // Each strand's own lambda_0 is at random up to this share longer or shorter, 0 to 0.95.
  float spread = 0;
  std::uint32_t seed = 1;
};

// lambda_0 at a root, before the spread.
float root_length_at(const RootLengths& lengths, const Vec3f& root_head);

// Sets lambda_0 of every rooted strand of `group` (kEveryGroup: all groups) from the position of its root. The same
// seed gives the same bits, and a strand's random factor does not depend on the choice of groups.
inline constexpr int kEveryGroup = -1;
void set_root_lengths(const RootLengths& lengths, int group, Groom& groom);

}  // namespace hairnet
