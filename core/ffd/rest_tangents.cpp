#include "core/ffd/rest_tangents.hpp"

#include <algorithm>
#include <cassert>

namespace hairnet {
namespace {

// Point i of a line is every `stride`-th of the groom: a strip has two edges.
void add_line(const Groom& groom, std::span<const float> blend, const PointRange& range, std::uint32_t stride,
              RestTangents& rest) {
  const std::uint32_t last = range.end - stride;
  for (std::uint32_t p = range.begin; p < range.end; ++p) {
    const std::uint32_t before = p < range.begin + stride ? p : p - stride, after = p >= last ? p : p + stride;
    const Vec3f chord = groom.points[after] - groom.points[before];
    const float chord_m = chord.norm();
    if (chord_m == 0) continue;
    const float arc_m =
        (groom.points[after] - groom.points[p]).norm() + (groom.points[p] - groom.points[before]).norm();
    rest.direction[p] = chord / chord_m;
    rest.blend_slope[p] = (blend[after] - blend[before]) / arc_m;
  }
}

}  // namespace

RestTangents rest_tangents(const Groom& groom, std::span<const float> blend) {
  assert(blend.size() == groom.points.size());
  RestTangents rest{std::vector<Vec3f>(groom.points.size(), Vec3f::Zero()),
                    std::vector<float>(groom.points.size(), 0.0f)};
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const PointRange range{groom.strand_begin[s], groom.strand_begin[s + 1]};
    if (range.count() > 0) add_line(groom, blend, range, 1, rest);
  }
  for (const Thread& thread : groom.threads) {
    if (thread.points.count() > 0) add_line(groom, blend, thread.points, 1, rest);
  }
  for (const Strip& strip : groom.strips) {
    if (strip.points.count() >= 2) add_line(groom, blend, strip.points, 2, rest);
  }
  return rest;
}

}  // namespace hairnet
