#include "core/build/hair_sample.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numbers>

#include "core/ffd/deform.hpp"

namespace hairnet {
namespace {

constexpr std::size_t kSampleCount = 4000;
constexpr int kSweeps = 12;
constexpr double kWeightLeast = 1e-3;

// Grid nodes as the active nodes that move them.
class Followed {
 public:
  explicit Followed(const LevelGeometry& geometry) : geometry_(geometry), place_(geometry.lattice.node_count()) {
    for (std::uint32_t a = 0; a < geometry.active_nodes.size(); ++a) place_[geometry.active_nodes[a]] = {true, a};
    for (std::uint32_t t = 0; t < geometry.trimmed_nodes.size(); ++t) place_[geometry.trimmed_nodes[t]] = {false, t};
  }

  void add(std::uint32_t node, double weight, std::map<std::uint32_t, double>& weight_of) const {
    const auto [is_active, index] = place_[node];
    if (is_active) {
      weight_of[index] += weight;
      return;
    }
    for (std::uint32_t e = geometry_.trimmed_begin[index]; e < geometry_.trimmed_begin[index + 1]; ++e) {
      weight_of[geometry_.trimmed_from[e]] += weight * static_cast<double>(geometry_.trimmed_weights[e]);
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
  std::map<std::uint32_t, double> weight_of;
  for (std::size_t p = 0; p < hair.points.size(); ++p) {
    weight_of.clear();
    for (const auto& [node, weight] : quadratic_ffd_weights(geometry.lattice, hair.points[p])) {
      followed.add(node, static_cast<double>(hair.blend[p]) * static_cast<double>(weight), weight_of);
    }
    for (const auto& [node, weight] : weight_of) {
      if (weight < kWeightLeast) continue;
      stencils.nodes.push_back(node);
      stencils.weights.push_back(weight);
    }
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
