#include "core/build/nearest_ends.hpp"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>

namespace hairnet {
namespace {

// nanoflann's names.
struct EndCloud {
  std::vector<EndPoints> points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t dim) const { return points[i][dim]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using EndTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, EndCloud>, EndCloud, 6>;

// Neighbours in space side by side in memory: searches in large sets then miss the cache less.
std::vector<std::uint32_t> cell_by_cell(const StiffenerList& list, std::span<const std::uint32_t> members) {
  std::vector<std::pair<std::array<int, 6>, std::uint32_t>> keys;
  keys.reserve(members.size());
  for (const std::uint32_t s : members) {
    const EndPoints ends = ordered_ends(list.ends[s]);
    std::array<int, 6> cell;
    for (int d = 0; d < 6; ++d) cell[d] = static_cast<int>(std::floor(ends[d]));
    keys.emplace_back(cell, s);
  }
  std::ranges::sort(keys);
  std::vector<std::uint32_t> ordered;
  ordered.reserve(keys.size());
  for (const auto& [cell, s] : keys) ordered.push_back(s);
  return ordered;
}

}  // namespace

EndPoints ordered_ends(const std::array<Vec3, 2>& ends) {
  const Vec3 along = ends[1] - ends[0];
  int axis = 0;
  along.cwiseAbs().maxCoeff(&axis);
  const int first = along[axis] >= 0 ? 0 : 1;
  const Vec3 &a = ends[first], &b = ends[1 - first];
  return {a[0], a[1], a[2], b[0], b[1], b[2]};
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> nearest_pairs(const StiffenerList& list,
                                                                   std::span<const std::uint32_t> members,
                                                                   std::size_t neighbour_count) {
  const std::vector<std::uint32_t> near = cell_by_cell(list, members);
  EndCloud cloud;
  cloud.points.reserve(near.size());
  for (const std::uint32_t s : near) cloud.points.push_back(ordered_ends(list.ends[s]));
  const EndTree tree(6, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(12));

  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  pairs.reserve(near.size() * neighbour_count);
  std::vector<std::uint32_t> found(neighbour_count + 1);  // itself among them
  std::vector<double> distances(neighbour_count + 1);
  for (std::size_t m = 0; m < near.size(); ++m) {
    const std::size_t count = tree.knnSearch(cloud.points[m].data(), found.size(), found.data(), distances.data());
    for (std::size_t i = 0; i < count; ++i) {
      if (found[i] != m) pairs.push_back(std::minmax({near[m], near[found[i]]}));
    }
  }
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

}  // namespace hairnet
