#include "core/ffd/strand_lengths.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// The arc length of each point of a strand from its root. Those at rest and deformed come from this one function, so
// equal points have equal arc lengths.
void measure(std::span<const Vec3f> strand, std::span<float> arc_m) {
  HAIRNET_ASSERT(arc_m.size() == strand.size());
  double length_m = 0;
  for (std::size_t i = 0; i < strand.size(); ++i) {
    if (i > 0) length_m += static_cast<double>((strand[i] - strand[i - 1]).norm());
    arc_m[i] = static_cast<float>(length_m);
  }
}

// Moves the points of a strand as strand_lengths.hpp says; `arc_m` and `rest_arc_m` are L and l of each point. It goes
// from the tip to the root. A point moves only towards the root, and comes to lie between two points that have not
// moved yet.
void limit_strand(std::span<Vec3f> strand, std::span<const float> arc_m, std::span<const float> rest_arc_m) {
  HAIRNET_ASSERT(arc_m.size() == strand.size());
  HAIRNET_ASSERT(rest_arc_m.size() == strand.size());
  // The end of the segment that contains the arc length l_i.
  std::size_t after = strand.size();
  for (std::size_t i = strand.size(); i-- > 1;) {
    const float wanted_m = rest_arc_m[i];
    if (arc_m[i] <= wanted_m) continue;
    after = std::min(after, i);
    while (arc_m[after - 1] > wanted_m) --after;
    HAIRNET_VALIDATE(after > 0);
    // The denominator is positive: arc_m[after - 1] is at most wanted_m, and arc_m[after] is greater.
    const float t = (wanted_m - arc_m[after - 1]) / (arc_m[after] - arc_m[after - 1]);
    strand[i] = strand[after - 1] + t * (strand[after] - strand[after - 1]);
  }
}

}  // namespace

StrandLengths::StrandLengths(std::span<const Vec3f> points, std::span<const std::uint32_t> strand_begin)
    : strand_begin_(strand_begin.begin(), strand_begin.end()), arc_m_(strand_begin.empty() ? 0 : strand_begin.back()) {
  HAIRNET_ASSERT(arc_m_.size() <= points.size());
  HAIRNET_ASSERT(std::ranges::is_sorted(strand_begin_));
  for (std::size_t s = 0; s + 1 < strand_begin_.size(); ++s) {
    const std::uint32_t begin = strand_begin_[s], count = strand_begin_[s + 1] - begin;
    measure(points.subspan(begin, count), std::span(arc_m_).subspan(begin, count));
  }
}

StrandLengths::StrandLengths(const Groom& groom) : StrandLengths(groom.points, groom.strand_begin) {}

void StrandLengths::limit(std::span<Vec3f> points) const {
  HAIRNET_ASSERT(points.size() >= arc_m_.size());
  std::vector<float> arc_m;
  for (std::size_t s = 0; s + 1 < strand_begin_.size(); ++s) {
    const std::uint32_t begin = strand_begin_[s], count = strand_begin_[s + 1] - begin;
    arc_m.resize(count);
    measure(points.subspan(begin, count), arc_m);
    limit_strand(points.subspan(begin, count), arc_m, std::span(arc_m_).subspan(begin, count));
  }
}

}  // namespace hairnet
