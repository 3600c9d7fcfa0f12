#include "core/levels/build_estimate.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"
#include "core/levels/fit_lattice.hpp"
#include "core/levels/grid.hpp"
#include "core/levels/level.hpp"

namespace hairnet {
namespace {

// The memory that a build takes for each spring, line, point and triangle, and for anything. The numbers are rounded up
// from measurements with an allocator that counts, on straight, curled and zigzag hair and on dense bodies.
// kBytesPerLine is for a strand's attachment and its lumped mass on one level, kBytesPerPoint for samples and maps, and
// kBytesPerTriangle for the trees of the body and of the bones' parts.
constexpr std::size_t kBytesPerSpring = 1000;
constexpr std::size_t kBytesPerLine = 200;
constexpr std::size_t kBytesPerPoint = 32;
constexpr std::size_t kBytesPerTriangle = 450;
constexpr std::size_t kBytesOfAnyBuild = std::size_t{32} << 20;

// The most points at which a segment is cut. It is cut at the lattice planes of one axis, so at most at those of the
// axis along which it crosses the most.
std::size_t cuts_of(const Vec3& from, const Vec3& to) {
  double planes = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = std::min(from[axis], to[axis]), high = std::max(from[axis], to[axis]);
    planes = std::max(planes, std::floor(high) - std::ceil(low) + 1);
  }
  return static_cast<std::size_t>(planes);
}

// The most springs of a strand or another line.
std::size_t pieces_of(const Grid& grid, std::span<const Vec3f> line) {
  std::size_t count = 1;
  for (std::size_t i = 1; i < line.size(); ++i) count += cuts_of(grid.from_head(line[i - 1]), grid.from_head(line[i]));
  return count;
}

// The most springs of a cloth. Each edge becomes a line of springs, and so does the other diagonal of a quad, which is
// shorter than the two edges that lead around it. Hence the factor 3 for each edge.
std::size_t pieces_of(const Grid& grid, const Groom& groom, const Cloth& cloth) {
  std::size_t count = 0;
  for (const auto& triangle : cloth.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3f &from = groom.points[triangle[i]], &to = groom.points[triangle[(i + 1) % 3]];
      count += 3 * (1 + cuts_of(grid.from_head(from), grid.from_head(to)));
    }
  }
  return count;
}

}  // namespace

BuildEstimate estimate_build(const Groom& groom) {
  HAIRNET_ASSERT(!groom.points.empty());
  BuildEstimate estimate;
  for (const LevelSpec& spec : kLevelSpecs) {
    const Grid grid(fit_lattice(groom.points, spec.dims));
    for (std::size_t s = 0; s < groom.strand_count(); ++s)
      estimate.spring_count += pieces_of(grid, groom.strand_points(s));
    for (const Thread& thread : groom.threads) estimate.spring_count += pieces_of(grid, groom.points_of(thread.points));
    for (const HairCard& card : groom.cards) estimate.spring_count += pieces_of(grid, groom.points_of(card.points));
    for (const Cloth& cloth : groom.cloths) estimate.spring_count += pieces_of(grid, groom, cloth);
  }
  const std::size_t lines = kLevelSpecs.size() * (groom.strand_count() + groom.threads.size() + groom.cards.size());
  // A linear bound is enough: a server refuses a groom by it before it spends memory on the build.
  estimate.memory_bytes = kBytesOfAnyBuild + kBytesPerSpring * estimate.spring_count + kBytesPerLine * lines +
                          kBytesPerPoint * groom.points.size() + kBytesPerTriangle * groom.body.mesh.triangles.size();
  return estimate;
}

}  // namespace hairnet
