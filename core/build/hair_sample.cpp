#include "core/build/hair_sample.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/ffd/deform.hpp"

namespace hairnet {
namespace {

constexpr std::size_t kSampleCount = 4000;
constexpr int kSweeps = 12;
constexpr double kWeightLeast = 1e-3;

// Sums of weights by active node, few of all of them at once.
class WeightSums {
 public:
  explicit WeightSums(std::size_t node_count) : sums_(node_count), is_in_(node_count) {}

  void add(std::uint32_t node, double weight) {
    if (!is_in_[node]) nodes_.push_back(node);
    is_in_[node] = true;
    sums_[node] += weight;
  }

  // Calls use(node, weight) for each, ascending by node, and forgets them.
  void take(const auto& use) {
    std::ranges::sort(nodes_);
    for (const std::uint32_t node : nodes_) {
      use(node, sums_[node]);
      sums_[node] = 0;
      is_in_[node] = false;
    }
    nodes_.clear();
  }

 private:
  std::vector<double> sums_;
  std::vector<bool> is_in_;
  std::vector<std::uint32_t> nodes_;
};

// Grid nodes as the active nodes that move them.
class Followed {
 public:
  explicit Followed(const LevelGeometry& geometry) : geometry_(geometry), place_(geometry.lattice.node_count()) {
    for (std::uint32_t a = 0; a < geometry.active_nodes.size(); ++a) place_[geometry.active_nodes[a]] = {true, a};
    for (std::uint32_t t = 0; t < geometry.trimmed_nodes.size(); ++t) place_[geometry.trimmed_nodes[t]] = {false, t};
  }

  void add(std::uint32_t node, double weight, WeightSums& sums) const {
    const auto [is_active, index] = place_[node];
    if (is_active) return sums.add(index, weight);
    for (std::uint32_t e = geometry_.trimmed_begin[index]; e < geometry_.trimmed_begin[index + 1]; ++e) {
      sums.add(geometry_.trimmed_from[e], weight * static_cast<double>(geometry_.trimmed_weights[e]));
    }
  }

 private:
  struct Place {
    bool is_active = false;
    std::uint32_t index = 0;  // active, or in the list of trimmed nodes
  };
  const LevelGeometry& geometry_;
  std::vector<Place> place_;
};

}  // namespace

HairSample sample_hair(const Groom& groom) {
  const std::vector<float> blend = root_blend(groom);
  const double share = static_cast<double>(kSampleCount) / static_cast<double>(std::max<std::size_t>(1, blend.size()));
  HairSample sample;
  for (std::size_t p = 0; p < groom.points.size(); ++p) {
    // Even over points and along strands alike, however many points a strand has.
    const double turn = static_cast<double>(p) * (std::numbers::phi - 1);
    if (turn - std::floor(turn) >= share) continue;
    sample.points.push_back(groom.points[p]);
    sample.blend.push_back(blend[p]);
  }
  return sample;
}

HairStencils make_stencils(const LevelGeometry& geometry, const HairSample& hair) {
  const Followed followed(geometry);
  HairStencils stencils;
  WeightSums sums(geometry.active_nodes.size());
  for (std::size_t p = 0; p < hair.points.size(); ++p) {
    for (const auto& [node, weight] : quadratic_ffd_weights(geometry.lattice, hair.points[p])) {
      followed.add(node, static_cast<double>(hair.blend[p]) * static_cast<double>(weight), sums);
    }
    sums.take([&](std::uint32_t node, double weight) {
      if (weight < kWeightLeast) return;
      stencils.nodes.push_back(node);
      stencils.weights.push_back(weight);
    });
    stencils.begin.push_back(static_cast<std::uint32_t>(stencils.nodes.size()));
  }
  return stencils;
}

void limit_travel(const HairStencils& stencils, std::span<const double> clearance_m, std::span<double> travel_m) {
  assert(clearance_m.size() + 1 == stencils.begin.size());
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (std::size_t p = 0; p < clearance_m.size(); ++p) {
      double moved = 0, square = 0;
      for (std::uint32_t e = stencils.begin[p]; e < stencils.begin[p + 1]; ++e) {
        const double travel = travel_m[stencils.nodes[e]], weight = stencils.weights[e];
        moved += weight * travel;
        if (travel > 0) square += weight * weight;
      }
      if (moved <= clearance_m[p] || square == 0) continue;
      const double excess = (moved - clearance_m[p]) / square;
      for (std::uint32_t e = stencils.begin[p]; e < stencils.begin[p + 1]; ++e) {
        double& travel = travel_m[stencils.nodes[e]];
        travel = std::max(0.0, travel - excess * stencils.weights[e]);
      }
    }
  }
}

}  // namespace hairnet
