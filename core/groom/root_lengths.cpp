#include "core/groom/root_lengths.hpp"

#include <algorithm>
#include <random>

#include "core/assert.hpp"

namespace hairnet {

float root_length_at(const RootLengths& lengths, const Vec3f& root_head) {
  // A region has the weight 1 at its centre and 0 at its edge. The length outside all regions has the weight that is
  // missing to 1. Where regions overlap so far that their weights exceed 1, the result is their mean by weight.
  float sum = 0, weighted = 0;
  for (const RootLengthRegion& region : lengths.regions) {
    HAIRNET_ASSERT(region.radius_m > 0);
    const float u = (root_head - region.centre).squaredNorm() / (region.radius_m * region.radius_m);
    const float weight = u < 1 ? (1 - u) * (1 - u) : 0;
    sum += weight;
    weighted += weight * region.root_length_m;
  }
  HAIRNET_ASSERT(!(sum < 0));
  return sum < 1 ? (1 - sum) * lengths.root_length_m + weighted : weighted / sum;
}

void set_root_lengths(const RootLengths& lengths, int group, Groom& groom) {
  HAIRNET_ASSERT(group == kEveryGroup || (group >= 0 && static_cast<std::size_t>(group) < groom.group_names.size()));
  HAIRNET_ASSERT(groom.strand_begin.size() == groom.strand_count() + 1);
  // The standard defines the numbers of this engine, unlike those of distributions.
  std::mt19937_64 random(lengths.seed);
  const float spread = std::clamp(lengths.spread, 0.0f, 0.95f);
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    // Every strand takes a number, also those that are left out, so a strand's factor does not depend on the group that
    // is asked for.
    // The chance is in [-1, 1).
    const auto chance = static_cast<float>(static_cast<double>(random() >> 11) * 0x1p-52 - 1);
    StrandProperties& strand = groom.strands[s];
    if (!strand.rooted || groom.strand_points(s).empty() || (group != kEveryGroup && strand.group != group)) continue;
    strand.root_length_m = root_length_at(lengths, groom.strand_points(s)[0]) * (1 + spread * chance);
  }
}

}  // namespace hairnet
