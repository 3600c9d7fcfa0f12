#include <algorithm>

#include "core/assert.hpp"
#include "core/ffd/deform.hpp"

namespace hairnet {
namespace {

// The group's own curve, or that of eq. 7.
const RootBlend& blend_of(const Groom& groom, std::uint16_t group) {
  static const RootBlend kEquation7;
  HAIRNET_ASSERT(groom.root_blends.empty() || group < groom.root_blends.size());
  return groom.root_blends.empty() ? kEquation7 : groom.root_blends[group];
}

// The delta of each point along a line from its root.
void blend_line(const RootBlend& blend, float root_length_m, std::span<const Vec3f> line, std::span<float> delta) {
  HAIRNET_ASSERT(root_length_m > 0);
  HAIRNET_ASSERT(delta.size() == line.size());
  double lambda = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (i > 0) lambda += static_cast<double>((line[i] - line[i - 1]).norm());
    delta[i] = static_cast<float>(blend_at(blend, lambda / static_cast<double>(root_length_m)));
  }
}

// The delta of a card's points, both of a pair with that of the middle. `middle_delta` is scratch memory, and `delta`
// has two entries for each point of `middle`.
void blend_card(const RootBlend& blend, float root_length_m, std::span<const Vec3f> middle,
                std::vector<float>& middle_delta, std::span<float> delta) {
  HAIRNET_ASSERT(delta.size() == 2 * middle.size());
  middle_delta.resize(middle.size());
  blend_line(blend, root_length_m, middle, middle_delta);
  for (std::size_t i = 0; i < delta.size(); ++i) delta[i] = middle_delta[i / 2];
}

}  // namespace

std::vector<float> root_blend(const Groom& groom) {
  std::vector<float> delta(groom.points.size(), 1.0f);
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const StrandProperties& strand = groom.strands[s];
    if (!strand.rooted || strand.root_length_m <= 0) continue;
    blend_line(blend_of(groom, strand.group), strand.root_length_m, groom.strand_points(s),
               {delta.data() + groom.strand_begin[s], delta.data() + groom.strand_begin[s + 1]});
  }
  for (const Thread& thread : groom.threads) {
    if (!thread.rooted || thread.root_length_m <= 0) continue;
    blend_line(blend_of(groom, thread.group), thread.root_length_m, groom.points_of(thread.points),
               {delta.data() + thread.points.begin, delta.data() + thread.points.end});
  }
  std::vector<Vec3f> middle;
  std::vector<float> middle_delta;
  for (const HairCard& card : groom.cards) {
    if (!card.properties.rooted || card.properties.root_length_m <= 0) continue;
    middle_of(groom, card, middle);
    blend_card(blend_of(groom, card.properties.group), card.properties.root_length_m, middle, middle_delta,
               {delta.data() + card.points.begin, delta.data() + card.points.end});
  }
  for (const Cloth& cloth : groom.cloths) {
    if (cloth.root_length_m <= 0) continue;
    HAIRNET_ASSERT(cloth.root_distance_m.empty() || cloth.root_distance_m.size() == cloth.points.count());
    // Cloth has no arc length from a root; its points know their distance from the pins instead.
    const RootBlend& blend = blend_of(groom, cloth.group);
    for (std::size_t i = 0; i < cloth.root_distance_m.size(); ++i) {
      const double ratio = static_cast<double>(cloth.root_distance_m[i]) / static_cast<double>(cloth.root_length_m);
      delta[cloth.points.begin + i] = static_cast<float>(blend_at(blend, ratio));
    }
  }
  HAIRNET_VALIDATE(std::ranges::all_of(delta, [](float d) { return d >= 0 && d <= 1; }));
  return delta;
}

}  // namespace hairnet
