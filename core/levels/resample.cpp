#include "core/levels/resample.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// Appends the points at which one segment crosses the lattice planes of the axis along which it is longest, in order
// from a to b. An end that lies on a plane is one of them.
void append_crossings(const Grid& grid, const Vec3& a, const Vec3& b, std::vector<Vec3>& cuts) {
  int axis = 0;
  // Lengths along the axes are compared in metres, since cells are not cubes.
  (b - a).cwiseProduct(grid.spacing()).cwiseAbs().maxCoeff(&axis);
  const double from = a[axis], to = b[axis];
  if (from == to) return;
  const double first_plane = std::ceil(std::min(from, to)), last_plane = std::floor(std::max(from, to));
  HAIRNET_ASSERT(first_plane <= last_plane + 1);
  const int count = static_cast<int>(last_plane - first_plane) + 1;
  for (int i = 0; i < count; ++i) {
    const double plane = from < to ? first_plane + i : last_plane - i;
    Vec3 cut = a + (plane - from) / (to - from) * (b - a);
    // The quotient above may miss the plane by rounding, and the point would then have weights on eight nodes.
    cut[axis] = plane;
    cuts.push_back(cut);
  }
}

// Removes interior points that are nearer than `length_min` to the previous point or to the tip.
void merge_short_pieces(const Grid& grid, double length_min, std::vector<Vec3>& cuts) {
  HAIRNET_ASSERT(cuts.size() >= 2);
  HAIRNET_ASSERT(length_min > 0);
  const Vec3 tip = cuts.back();
  std::size_t kept = 1;
  for (std::size_t i = 1; i + 1 < cuts.size(); ++i) {
    if (grid.length(cuts[i] - cuts[kept - 1]) >= length_min) cuts[kept++] = cuts[i];
  }
  // The tip always stays, so short pieces before it are dropped from behind.
  while (kept > 1 && grid.length(tip - cuts[kept - 1]) < length_min) --kept;
  cuts.resize(kept);
  cuts.push_back(tip);
  HAIRNET_VALIDATE(cuts.size() == 2 || std::ranges::adjacent_find(cuts, [&](const Vec3& a, const Vec3& b) {
                                         return grid.length(b - a) < length_min;
                                       }) == cuts.end());
}

}  // namespace

void polyline_on_grid(const Grid& grid, std::span<const Vec3f> points_head, std::vector<Vec3>& polyline) {
  polyline.clear();
  for (const Vec3f& point : points_head) {
    const Vec3 on_grid = grid.from_head(point);
    if (polyline.empty() || polyline.back() != on_grid) polyline.push_back(on_grid);
  }
  HAIRNET_ASSERT(polyline.empty() == points_head.empty());
}

double arc_length(const Grid& grid, std::span<const Vec3> polyline) {
  double length = 0;
  for (std::size_t i = 1; i < polyline.size(); ++i) length += grid.length(polyline[i] - polyline[i - 1]);
  return length;
}

double piece_length_min(const Grid& grid) {
  return 0.1 * grid.spacing().minCoeff();
}

void cut_points(const Grid& grid, std::span<const Vec3> polyline, std::vector<Vec3>& cuts) {
  HAIRNET_ASSERT(polyline.size() >= 2);
  cuts.assign(1, polyline.front());
  for (std::size_t i = 1; i < polyline.size(); ++i) append_crossings(grid, polyline[i - 1], polyline[i], cuts);
  cuts.push_back(polyline.back());
  merge_short_pieces(grid, piece_length_min(grid), cuts);
  HAIRNET_ASSERT(cuts.front() == polyline.front());
  HAIRNET_ASSERT(cuts.back() == polyline.back());
}

}  // namespace hairnet
