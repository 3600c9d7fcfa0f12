#include "core/ffd/rest_tangents.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// Takes every `stride`-th of `points`: a card has two edges.
void add_line(std::span<const Vec3f> points, std::span<const float> blend, const PointRange& range,
              std::uint32_t stride, RestTangents& rest) {
  HAIRNET_ASSERT(range.begin < range.end);
  HAIRNET_ASSERT(range.end <= points.size());
  HAIRNET_ASSERT(range.count() >= stride);
  HAIRNET_ASSERT(range.count() % stride == 0);
  const std::uint32_t last = range.end - stride;
  for (std::uint32_t p = range.begin; p < range.end; ++p) {
    const std::uint32_t before = p < range.begin + stride ? p : p - stride, after = p >= last ? p : p + stride;
    const Vec3f chord = points[after] - points[before];
    const float chord_m = chord.norm();
    // A point whose neighbours coincide keeps the zero tangent.
    if (chord_m == 0) continue;
    const float arc_m = (points[after] - points[p]).norm() + (points[p] - points[before]).norm();
    HAIRNET_ASSERT(arc_m > 0);
    rest.direction[p] = chord / chord_m;
    rest.blend_slope[p] = (blend[after] - blend[before]) / arc_m;
  }
}

}  // namespace

RestTangents rest_tangents(const Groom& groom, std::span<const float> blend) {
  HAIRNET_ASSERT(blend.size() == groom.points.size());
  RestTangents rest{std::vector<Vec3f>(groom.points.size(), Vec3f::Zero()),
                    std::vector<float>(groom.points.size(), 0.0f)};
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const PointRange range{groom.strand_begin[s], groom.strand_begin[s + 1]};
    if (range.count() > 0) add_line(groom.points, blend, range, 1, rest);
  }
  for (const Thread& thread : groom.threads) {
    if (thread.points.count() > 0) add_line(groom.points, blend, thread.points, 1, rest);
  }
  for (const HairCard& card : groom.cards) {
    if (card.points.count() >= 2) add_line(groom.points, blend, card.points, 2, rest);
  }
  return rest;
}

}  // namespace hairnet
