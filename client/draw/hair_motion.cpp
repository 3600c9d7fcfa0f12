#include "client/draw/hair_motion.hpp"

#include <algorithm>
#include <utility>

#include "client/draw/character_records.hpp"
#include "core/ffd/bspline.hpp"

namespace hairnet::draw {

Vec3f displacement_at(const HairMotion::Nodes& nodes, const Vec3f& rest) {
  const auto& [lattice, grid] = nodes;
  Vec3f sum = Vec3f::Zero();
  if (grid.empty()) return sum;
  const auto last = static_cast<std::uint32_t>(lattice.node_count() - 1);
  // Beyond the lattice the place is moved to its border, where linear weights are defined.
  const FfdSite site = ffd_site(lattice, FfdKind::linear, rest.cwiseMax(lattice.origin).cwiseMin(lattice.node(last)));
  for (int corner = 0; corner < 8; ++corner) {
    float share = 1;
    std::uint32_t node = site.base, stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const bool upper = (corner >> axis & 1) != 0;
      share *= upper ? site.t[axis] : 1 - site.t[axis];
      if (upper) node += stride;
      stride *= static_cast<std::uint32_t>(lattice.dims[static_cast<std::size_t>(axis)]);
    }
    sum += share * grid[node];
  }
  return sum;
}

std::vector<HairMotion::Motion> HairMotion::motions(std::span<const MovingCharacter> shown) {
  std::vector<const MovingCharacter*> largest;
  // Sorted by insertion, as pointers: nothing is copied of characters that are left out below.
  for (const MovingCharacter& one : shown) {
    if (one.id == 0) continue;
    const auto place =
        std::ranges::upper_bound(largest, one.head_px, std::ranges::greater{}, &MovingCharacter::head_px);
    largest.insert(place, &one);
  }
  std::map<std::uint64_t, Before> now;
  std::vector<Motion> motions;
  std::vector<Vec3f> scratch;
  for (const MovingCharacter* one : largest) {
    const auto known = before_.find(one->id);
    const bool is_known = known != before_.end() && motions.size() < kMovingMax;
    // The largest take the slots; a smaller one is dropped as soon as all are taken.
    if (!is_known && now.size() == kMovingMax) continue;
    // Nodes are kept even without a known motion, because the next picture needs them.
    Before state{one->head, one->scale, {}};
    if (moves_hair(one->lattice)) {
      const std::span<const Vec3f> nodes = nodes_of(one->lattice, scratch);
      state.nodes = {one->lattice.geometry->lattice, {nodes.begin(), nodes.end()}};
    }
    if (is_known) {
      write_swing(motions.size(), state.nodes, known->second.nodes, one->ball_radius_m);
      motions.push_back({one->head, known->second.head, one->scale, known->second.scale, one->ball_radius_m});
    }
    // Only the largest are remembered, so one that grows into the list has its first motion a picture later.
    if (now.size() < kMovingMax) now.emplace(one->id, std::move(state));
  }
  before_ = std::move(now);
  return motions;
}

void HairMotion::write_swing(std::size_t motion, const Nodes& now, const Nodes& before, float ball_radius_m) {
  constexpr std::size_t kNodes = kSwingNodes * kSwingNodes * kSwingNodes;
  const auto place = [&](std::size_t n) {
    return (2 * static_cast<float>(n) / static_cast<float>(kSwingNodes - 1) - 1) * ball_radius_m;
  };
  for (std::size_t n = 0; n < kNodes; ++n) {
    const Vec3f at(place(n % kSwingNodes), place(n / kSwingNodes % kSwingNodes), place(n / kSwingNodes / kSwingNodes));
    // Inverts the displacement in one step: rest + displacement(rest) = place, and the displacement changes little over
    // its own length.
    const Vec3f rest = at - displacement_at(now, at);
    swing_[motion * kNodes + n].head<3>() = displacement_at(before, rest) - displacement_at(now, rest);
  }
}

}  // namespace hairnet::draw
