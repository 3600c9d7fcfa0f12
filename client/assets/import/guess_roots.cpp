#include "client/assets/import/guess_roots.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "client/assets/import/guess_unit.hpp"

namespace hairnet {
namespace {

// Fewer strands than kEndsMin show no scalp at either end; more than kEndsMax add nothing.
constexpr std::size_t kEndsMax = 1500, kEndsMin = 8;
// This many points of a strand show whether it passes through the skull.
constexpr std::uint32_t kProbesOfStrand = 8;
// Points deeper than this share of the radius are inside of the skull, where there is no hair. Real hair may enter a
// fitted skull a little, because a skull is no ellipsoid.
constexpr double kInside = 0.12;
// The last points must be the better scalp by this difference of unlike_roots(). Most files store roots first, so a
// smaller difference must not turn them.
constexpr double kClearly = 0.08;

struct Ends {
  std::vector<Vec3> first, last, points;
};

Ends ends_of(std::span<const StrandFile> files) {
  std::size_t count = 0;
  for (const StrandFile& file : files) count += file.strands.strand_count();
  const std::size_t step = count / kEndsMax + 1;
  Ends ends;
  std::size_t n = 0;
  for (const StrandFile& file : files) {
    const ImportedStrands& strands = file.strands;
    for (std::size_t s = 0; s < strands.strand_count(); ++s) {
      const std::uint32_t begin = strands.strand_begin[s], end = strands.strand_begin[s + 1];
      if (end - begin < 2 || n++ % step != 0) continue;
      ends.first.push_back(strands.points[begin].cast<double>());
      ends.last.push_back(strands.points[end - 1].cast<double>());
      for (std::uint32_t i = 0; i < kProbesOfStrand; ++i)
        ends.points.push_back(strands.points[begin + i * (end - 1 - begin) / (kProbesOfStrand - 1)].cast<double>());
    }
  }
  return ends;
}

// Returns about 0 for the roots of hair. The number is larger for points that lie off any skull, that show no skull or
// one with hair inside, that have the size of a head in no usual unit, or that are spread wider than the other ends.
// The surer a sign is, the more it counts: the misfit of the shell has the factor 2, hair inside 0.5, the spread 0.3,
// and each of the two others 0.1.
double unlike_roots(const std::vector<Vec3>& ends, const std::vector<Vec3>& other, const std::vector<Vec3>& points) {
  const ScalpFit scalp = fit_scalp(ends);
  std::size_t inside = 0;
  for (const Vec3& x : points) inside += scalp.skull.distance(x) < -kInside * scalp.skull.radius();
  const double share = static_cast<double>(inside) / static_cast<double>(points.size());
  // Tips are spread wider than roots in all but very short hair.
  const double wider = std::max(0.0, std::log(longest_extent(ends) / longest_extent(other)));
  const double unlike = 2 * std::min(scalp.misfit, 0.5) + 0.5 * share + 0.3 * std::min(wider, 1.0);
  return unlike + (guess_unit(ends).is_usual ? 0 : 0.1) + (scalp.skull.is_determined() ? 0 : 0.1);
}

}  // namespace

// Both ends are measured in the same way and compared, so no absolute limit is necessary.
bool are_tips_first(std::span<const StrandFile> files) {
  const Ends ends = ends_of(files);
  if (ends.first.size() < kEndsMin) return false;
  const double first = unlike_roots(ends.first, ends.last, ends.points);
  const double last = unlike_roots(ends.last, ends.first, ends.points);
  return first > last + kClearly;
}

void turn_round(std::span<StrandFile> files) {
  for (StrandFile& file : files) {
    std::vector<Vec3f>& points = file.strands.points;
    const std::vector<std::uint32_t>& begin = file.strands.strand_begin;
    for (std::size_t s = 0; s < file.strands.strand_count(); ++s)
      std::reverse(points.begin() + begin[s], points.begin() + begin[s + 1]);
  }
}

}  // namespace hairnet
