#include "core/levels/hair_sample.hpp"

#include <algorithm>

#include "core/assert.hpp"
#include "core/ffd/deform.hpp"
#include "core/random.hpp"

namespace hairnet {
namespace {

// Smaller weights of a stencil are dropped (HairStencils).
constexpr double kWeightMin = 0.01;

// Sums of weights, by active node. Only a few nodes have a sum at a time, so clearing takes no pass over all nodes.
class WeightSums {
 public:
  explicit WeightSums(std::size_t node_count) : sums_(node_count), is_in_(node_count) {}

  void add(std::uint32_t node, double weight) {
    HAIRNET_VALIDATE(node < sums_.size());
    if (!is_in_[node]) nodes_.push_back(node);
    is_in_[node] = true;
    sums_[node] += weight;
  }

  // Calls use(node, weight) for each sum, ascending by node, and clears them.
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

// The active nodes that each grid node follows: an active node itself, a trimmed one its combination (LevelGeometry).
class Followed {
 public:
  explicit Followed(const LevelGeometry& geometry) : geometry_(geometry), place_(geometry.lattice.node_count()) {
    HAIRNET_ASSERT(geometry.active_nodes.size() + geometry.trimmed_nodes.size() == place_.size());
    HAIRNET_ASSERT(geometry.trimmed_begin.size() == geometry.trimmed_nodes.size() + 1);
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
    // The active index, or the index in the list of trimmed nodes.
    std::uint32_t index = 0;
  };
  const LevelGeometry& geometry_;
  std::vector<Place> place_;
};

}  // namespace

HairSample sample_hair(const Groom& groom, std::size_t count) {
  HAIRNET_ASSERT(count > 0);
  const std::vector<float> blend = root_blend(groom);
  HAIRNET_ASSERT(blend.size() == groom.points.size());
  const std::size_t whole = groom.points.size();
  count = std::min(count, whole);
  // One random point is taken from each of `count` equal runs of points. An even step would always meet strands of
  // equal length at the same points. The seed is fixed, so that levels are the same in every build.
  Random random(1);
  HairSample sample;
  const double step = static_cast<double>(whole) / static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto p = std::min(static_cast<std::size_t>(step * (static_cast<double>(i) + random.unit())), whole - 1);
    sample.points.push_back(groom.points[p]);
    sample.blend.push_back(blend[p]);
  }
  return sample;
}

HairStencils make_stencils(const LevelGeometry& geometry, const HairSample& hair) {
  HAIRNET_ASSERT(hair.blend.size() == hair.points.size());
  const Followed followed(geometry);
  HairStencils stencils;
  WeightSums sums(geometry.active_nodes.size());
  for (std::size_t p = 0; p < hair.points.size(); ++p) {
    for (const auto& [node, weight] : quadratic_ffd_weights(geometry.lattice, hair.points[p])) {
      followed.add(node, static_cast<double>(hair.blend[p]) * static_cast<double>(weight), sums);
    }
    // The sum of all weights of the point, and of those that are not dropped.
    double whole = 0, kept = 0;
    const std::size_t first = stencils.weights.size();
    sums.take([&](std::uint32_t node, double weight) {
      whole += weight;
      if (weight < kWeightMin) return;
      kept += weight;
      stencils.nodes.push_back(node);
      stencils.weights.push_back(weight);
    });
    HAIRNET_ASSERT(whole <= 1 + 1e-4);
    HAIRNET_ASSERT(stencils.weights.size() == first || whole > 0);
    // Scaling up keeps the sum of the weights, so a lattice that moves as a whole moves the point exactly.
    for (std::size_t e = first; e < stencils.weights.size(); ++e) stencils.weights[e] *= whole / kept;
    stencils.begin.push_back(static_cast<std::uint32_t>(stencils.nodes.size()));
  }
  HAIRNET_ASSERT(stencils.begin.size() == hair.points.size() + 1);
  HAIRNET_ASSERT(stencils.weights.size() == stencils.nodes.size());
  return stencils;
}

}  // namespace hairnet
