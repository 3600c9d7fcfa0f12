#include "core/levels/nearest_chords.hpp"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>

#include "core/assert.hpp"

namespace hairnet {
namespace {

using ChordPoint = std::array<float, 6>;

// The points of the k-d tree; the names of the functions are nanoflann's.
struct ChordCloud {
  std::vector<ChordPoint> points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t dim) const { return points[i][dim]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using ChordTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, ChordCloud>, ChordCloud, 6>;

// A chord as a point of six numbers: its midpoint, and its weighted vector with the greatest component positive. When
// two components are nearly equal, near chords may get opposite signs and miss each other in the tree. This costs no
// more than a candidate, as squared_distance compares both signs.
ChordPoint point_of(const Chord& chord) {
  HAIRNET_VALIDATE(chord[0].allFinite());
  HAIRNET_VALIDATE(chord[1].allFinite());
  const Vec3 middle = 0.5 * (chord[0] + chord[1]);
  Vec3 vector = kVectorWeight * (chord[1] - chord[0]);
  int axis = 0;
  vector.cwiseAbs().maxCoeff(&axis);
  if (vector[axis] < 0) vector = -vector;
  ChordPoint point;
  for (int d = 0; d < 3; ++d) {
    point[d] = static_cast<float>(middle[d]);
    point[d + 3] = static_cast<float>(vector[d]);
  }
  return point;
}

// Sorts neighbours in space together in memory: searches in large sets then have fewer cache misses.
std::vector<std::uint32_t> cell_by_cell(std::span<const Chord> chords, std::span<const std::uint32_t> members) {
  std::vector<std::pair<std::array<int, 6>, std::uint32_t>> keys;
  keys.reserve(members.size());
  HAIRNET_VALIDATE(std::ranges::all_of(members, [&](std::uint32_t s) { return s < chords.size(); }));
  for (const std::uint32_t s : members) {
    const ChordPoint point = point_of(chords[s]);
    std::array<int, 6> cell;
    for (int d = 0; d < 6; ++d) cell[d] = static_cast<int>(std::floor(point[d]));
    keys.emplace_back(cell, s);
  }
  std::ranges::sort(keys);
  std::vector<std::uint32_t> ordered;
  ordered.reserve(keys.size());
  for (const auto& [cell, s] : keys) ordered.push_back(s);
  return ordered;
}

ChordCloud cloud_of(std::span<const Chord> chords, std::span<const std::uint32_t> members) {
  ChordCloud cloud;
  cloud.points.reserve(members.size());
  for (const std::uint32_t s : members) cloud.points.push_back(point_of(chords[s]));
  return cloud;
}

}  // namespace

double squared_distance(const Chord& a, const Chord& b) {
  const Vec3 middle = 0.5 * ((a[0] + a[1]) - (b[0] + b[1]));
  const Vec3 vector_a = a[1] - a[0], vector_b = b[1] - b[0];
  const Vec3 vector = vector_a.dot(vector_b) < 0 ? Vec3(vector_a + vector_b) : Vec3(vector_a - vector_b);
  return middle.squaredNorm() + kVectorWeight * kVectorWeight * vector.squaredNorm();
}

struct NearestChords::Impl {
  Impl(std::span<const Chord> chords, std::span<const std::uint32_t> all)
      : members(cell_by_cell(chords, all)),
        cloud(cloud_of(chords, members)),
        tree(6, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(12)) {}
  std::vector<std::uint32_t> members;
  ChordCloud cloud;
  ChordTree tree;
};

NearestChords::NearestChords(std::span<const Chord> chords, std::span<const std::uint32_t> members)
    : impl_(std::make_unique<Impl>(chords, members)) {
  HAIRNET_ASSERT(!members.empty());
  HAIRNET_ASSERT(impl_->members.size() == members.size());
}
NearestChords::~NearestChords() = default;
NearestChords::NearestChords(NearestChords&&) noexcept = default;
NearestChords& NearestChords::operator=(NearestChords&&) noexcept = default;

void NearestChords::append_pairs(std::size_t begin, std::size_t end, std::size_t neighbour_count, Pairs& pairs) const {
  HAIRNET_ASSERT(impl_ != nullptr);
  HAIRNET_ASSERT(begin <= end);
  HAIRNET_ASSERT(end <= impl_->members.size());
  HAIRNET_ASSERT(neighbour_count > 0);
  // The search finds the chord itself too, so it asks for one more.
  std::vector<std::uint32_t> found(neighbour_count + 1);
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
