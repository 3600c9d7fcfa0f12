#include "server/room/interest.hpp"

#include <algorithm>
#include <limits>
#include <nanoflann.hpp>
#include <optional>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

struct Distance {
  double m2 = 0;
  std::uint32_t member = 0;
  std::size_t index = 0;
};

// A plain loop over fewer points is as fast as a tree.
constexpr std::size_t kTreePointsMin = 16;

// The interface that nanoflann asks for; the names are nanoflann's.
struct PointCloud {
  std::span<const Vec3> points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t point, std::size_t axis) const {
    return points[point][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using PointTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointCloud>, PointCloud, 3>;

// Squared distances to the nearest of some points; zero without points.
class NearestPoint {
 public:
  explicit NearestPoint(std::span<const Vec3> points) : cloud_{points} {
    if (points.size() >= kTreePointsMin) tree_.emplace(3, cloud_);
  }
  [[nodiscard]] double distance2(const Vec3& head) const {
    if (cloud_.points.empty()) return 0;
    if (tree_) {
      std::uint32_t nearest = 0;
      double m2 = 0;
      tree_->knnSearch(head.data(), 1, &nearest, &m2);
      // The distance is computed as the plain loop does it, so that both give the same bits, whatever nanoflann's order
      // of sums.
      return (head - cloud_.points[nearest]).squaredNorm();
    }
    double least = std::numeric_limits<double>::infinity();
    for (const Vec3& point : cloud_.points) least = std::min(least, (head - point).squaredNorm());
    return least;
  }

 private:
  PointCloud cloud_;
  // A tree is made for many points only.
  std::optional<PointTree> tree_;
};

std::vector<Distance> distances(const wire::Observe& observe, std::span<const MemberHead> heads) {
  std::vector<Vec3> from;
  if (observe.from) {
    from.push_back(observe.from->cast<double>());
  } else {
    for (const MemberHead& head : heads) {
      // A member without a pose has no place yet.
      if (head.own && head.has_pose) from.push_back(head.head);
    }
  }
  const NearestPoint nearest(from);
  std::vector<Distance> all;
  for (std::size_t i = 0; i < heads.size(); ++i) {
    // A session's own members take none of the `count` places: it always gets them.
    if (!heads[i].own && heads[i].has_pose) all.push_back({nearest.distance2(heads[i].head), heads[i].member, i});
  }
  return all;
}

}  // namespace

void choose_members(const wire::Observe& observe, std::span<const MemberHead> heads, std::vector<bool>& wanted) {
  HAIRNET_VALIDATE(wire::validate(observe).empty());
  HAIRNET_VALIDATE(std::ranges::is_sorted(heads, {}, &MemberHead::member));
  wanted.assign(heads.size(), observe.mode == wire::ObserveMode::all);
  if (observe.mode == wire::ObserveMode::list) {
    for (const std::uint32_t member : observe.members) {
      const auto head = std::ranges::lower_bound(heads, member, {}, &MemberHead::member);
      // A number that names nobody yet is no error: the member may have left meanwhile.
      if (head != heads.end() && head->member == member) wanted[static_cast<std::size_t>(head - heads.begin())] = true;
    }
  } else if (observe.mode != wire::ObserveMode::all) {
    std::vector<Distance> others = distances(observe, heads);
    std::size_t count = 0;
    if (observe.mode == wire::ObserveMode::nearest) {
      count = std::min<std::size_t>(observe.count, others.size());
      // The nearest `count` are needed in no order, so a full sort is not. The member number breaks ties: the choice is
      // the same in each run.
      std::ranges::nth_element(others, others.begin() + static_cast<std::ptrdiff_t>(count), {},
                               [](const Distance& d) { return std::pair(d.m2, d.member); });
    } else {
      const double radius2 = double{observe.radius_m} * observe.radius_m;
      count = static_cast<std::size_t>(
          std::ranges::partition(others, [&](const Distance& d) { return d.m2 <= radius2; }).begin() - others.begin());
    }
    HAIRNET_ASSERT(count <= others.size());
    for (std::size_t i = 0; i < count; ++i) wanted[others[i].index] = true;
  }
  for (std::size_t i = 0; i < heads.size(); ++i) {
    if (heads[i].own) wanted[i] = true;
  }
}

}  // namespace hairnet::server
