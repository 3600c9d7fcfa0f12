#include "core/build/nearest_ends.hpp"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>

namespace hairnet {
namespace {

// nanoflann's names.
struct EndCloud {
  std::vector<std::array<float, 6>> points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t dim) const { return points[i][dim]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using EndTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, EndCloud>, EndCloud, 6>;

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

EndCloud cloud_of(const StiffenerList& list, std::span<const std::uint32_t> members) {
  EndCloud cloud;
  cloud.points.reserve(members.size());
  for (const std::uint32_t s : members) {
    const EndPoints ends = ordered_ends(list.ends[s]);
    std::ranges::transform(ends, cloud.points.emplace_back().begin(), [](double x) { return static_cast<float>(x); });
  }
  return cloud;
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

struct NearestEnds::Impl {
  Impl(const StiffenerList& list, std::span<const std::uint32_t> all)
      : members(cell_by_cell(list, all)),
        cloud(cloud_of(list, members)),
        tree(6, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(12)) {}
  std::vector<std::uint32_t> members;
  EndCloud cloud;
  EndTree tree;
};

NearestEnds::NearestEnds(const StiffenerList& list, std::span<const std::uint32_t> members)
    : impl_(std::make_unique<Impl>(list, members)) {}
NearestEnds::~NearestEnds() = default;
NearestEnds::NearestEnds(NearestEnds&&) noexcept = default;
NearestEnds& NearestEnds::operator=(NearestEnds&&) noexcept = default;

void NearestEnds::append_pairs(std::size_t begin, std::size_t end, std::size_t neighbour_count, Pairs& pairs) const {
  std::vector<std::uint32_t> found(neighbour_count + 1);  // itself among them
  std::vector<float> distances(neighbour_count + 1);
  for (std::size_t m = begin; m < end; ++m) {
    const std::size_t count =
        impl_->tree.knnSearch(impl_->cloud.points[m].data(), found.size(), found.data(), distances.data());
    for (std::size_t i = 0; i < count; ++i) {
      if (found[i] != m) pairs.push_back(std::minmax({impl_->members[m], impl_->members[found[i]]}));
    }
  }
}

}  // namespace hairnet
