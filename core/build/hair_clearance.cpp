#include "core/build/hair_clearance.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>
#include <numbers>

namespace hairnet {
namespace {

constexpr std::size_t kSampleCount = 4000;
constexpr int kSweeps = 12;
constexpr double kWeightLeast = 1e-3;

// delta(lambda) of eq. 7.
float blend_at(double lambda_m, const StrandProperties& strand) {
  const auto lambda_0 = static_cast<double>(strand.root_length_m);
  if (!strand.rooted || lambda_0 <= 0) return 1;
  return static_cast<float>(-std::expm1(-(lambda_m / lambda_0) * (lambda_m / lambda_0)));
}

std::array<double, 3> quadratic_weights(double t) {
  return {0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)};
}

}  // namespace

HairSample sample_hair(const Groom& groom) {
  HairSample sample;
  const double share = static_cast<double>(kSampleCount) / static_cast<double>(std::max<std::size_t>(1, groom.points.size()));
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    double lambda_m = 0;
    for (std::uint32_t p = groom.strand_begin[s]; p < groom.strand_begin[s + 1]; ++p) {
      if (p > groom.strand_begin[s]) lambda_m += static_cast<double>((groom.points[p] - groom.points[p - 1]).norm());
      // Even over points and along strands alike, however many points a strand has.
      const double turn = p * (std::numbers::phi - 1);
      if (turn - std::floor(turn) >= share) continue;
      sample.points.push_back(groom.points[p]);
      sample.blend.push_back(blend_at(lambda_m, groom.strands[s]));
    }
  }
  return sample;
}

HairStencils make_stencils(const LevelGeometry& geometry, const HairSample& hair) {
  const Lattice& lattice = geometry.lattice;
  // Of every grid node: its active index, or where its combination begins.
  std::vector<std::uint32_t> position(lattice.node_count());
  std::vector<bool> is_active(lattice.node_count());
  for (std::uint32_t a = 0; a < geometry.active_nodes.size(); ++a) {
    position[geometry.active_nodes[a]] = a;
    is_active[geometry.active_nodes[a]] = true;
  }
  for (std::uint32_t t = 0; t < geometry.trimmed_nodes.size(); ++t) position[geometry.trimmed_nodes[t]] = t;

  HairStencils stencils;
  stencils.spacing_m = static_cast<double>(lattice.spacing.norm()) / std::sqrt(3.0);
  std::map<std::uint32_t, double> weight_of;
  for (std::size_t p = 0; p < hair.points.size(); ++p) {
    weight_of.clear();
    std::array<int, 3> middle{};
    std::array<std::array<double, 3>, 3> w{};
    for (int a = 0; a < 3; ++a) {
      const double g = static_cast<double>((hair.points[p][a] - lattice.origin[a]) / lattice.spacing[a]);
      middle[a] = std::clamp(static_cast<int>(std::lround(g)), 1, lattice.dims[a] - 2);
      w[a] = quadratic_weights(std::clamp(g - middle[a], -0.5, 0.5));
    }
    for (int n = 0; n < 27; ++n) {
      const int i = n % 3, j = n / 3 % 3, k = n / 9;
      const double weight = static_cast<double>(hair.blend[p]) * w[0][i] * w[1][j] * w[2][k];
      const std::uint32_t node = lattice.index(middle[0] + i - 1, middle[1] + j - 1, middle[2] + k - 1);
      if (is_active[node]) {
        weight_of[position[node]] += weight;
        continue;
      }
      for (std::uint32_t e = geometry.trimmed_begin[position[node]]; e < geometry.trimmed_begin[position[node] + 1]; ++e)
        weight_of[geometry.trimmed_from[e]] += weight * static_cast<double>(geometry.trimmed_weights[e]);
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
        const double travel = std::min(travel_m[stencils.nodes[e]], kTravelMost_m);
        moved += stencils.weights[e] * travel;
        if (travel > 0) square += stencils.weights[e] * stencils.weights[e];
      }
      if (moved <= clearance_m[p] || square == 0) continue;
      const double excess = (moved - clearance_m[p]) / square;
      for (std::uint32_t e = stencils.begin[p]; e < stencils.begin[p + 1]; ++e) {
        double& travel = travel_m[stencils.nodes[e]];
        if (travel > 0) travel = std::max(0.0, std::min(travel, kTravelMost_m) - excess * stencils.weights[e]);
      }
    }
  }
}

}  // namespace hairnet
