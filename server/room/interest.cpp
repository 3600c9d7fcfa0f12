#include "server/room/interest.hpp"

#include <algorithm>
#include <limits>
#include <unordered_set>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

struct Distance {
  double m2 = 0;
  std::uint32_t member = 0;
  std::size_t index = 0;
};

// Squared distance to the nearest of `from`; zero when `from` is empty.
double distance2(const Vec3& head, std::span<const Vec3> from) {
  double least = from.empty() ? 0 : std::numeric_limits<double>::infinity();
  for (const Vec3& point : from) least = std::min(least, (head - point).squaredNorm());
  return least;
}

std::vector<Distance> distances(const wire::Observe& observe, std::span<const MemberHead> heads) {
  std::vector<Vec3> from;
  if (observe.from) {
    from.push_back(observe.from->cast<double>());
  } else {
    for (const MemberHead& head : heads) {
      if (head.own && head.has_pose) from.push_back(head.head);
    }
  }
  std::vector<Distance> all;
  for (std::size_t i = 0; i < heads.size(); ++i) {
    if (!heads[i].own && heads[i].has_pose) all.push_back({distance2(heads[i].head, from), heads[i].member, i});
  }
  return all;
}

}  // namespace

void choose_members(const wire::Observe& observe, std::span<const MemberHead> heads, std::vector<bool>& wanted) {
  HAIRNET_VALIDATE(wire::validate(observe).empty());
  HAIRNET_VALIDATE(std::ranges::is_sorted(heads, {}, &MemberHead::member));
  wanted.assign(heads.size(), observe.mode == wire::ObserveMode::all);
  if (observe.mode == wire::ObserveMode::list) {
    const std::unordered_set<std::uint32_t> listed(observe.members.begin(), observe.members.end());
    for (std::size_t i = 0; i < heads.size(); ++i) wanted[i] = listed.contains(heads[i].member);
  } else if (observe.mode != wire::ObserveMode::all) {
    std::vector<Distance> others = distances(observe, heads);
    std::size_t count = others.size();
    if (observe.mode == wire::ObserveMode::nearest) {
      count = std::min<std::size_t>(observe.count, others.size());
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
