#include "core/build/hair_sample.hpp"

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

// Model section 7: the 27 nodes nearest to a point and their quadratic weights. The lattice's margin keeps every point
// within half a cell of a node that is not at the border.
struct GridStencil {
  GridStencil(const Lattice& grid, const Vec3f& point) : lattice(grid) {
    for (int a = 0; a < 3; ++a) {
      const auto g = static_cast<double>((point[a] - lattice.origin[a]) / lattice.spacing[a]);
      middle[a] = std::clamp(static_cast<int>(std::lround(g)), 1, lattice.dims[a] - 2);
      const double t = std::clamp(g - middle[a], -0.5, 0.5);
      weights[a] = {0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)};
    }
  }
  [[nodiscard]] double weight(int n) const { return weights[0][n % 3] * weights[1][n / 3 % 3] * weights[2][n / 9]; }
  [[nodiscard]] std::uint32_t node(int n) const {
    return lattice.index(middle[0] + n % 3 - 1, middle[1] + n / 3 % 3 - 1, middle[2] + n / 9 - 1);
  }

  const Lattice& lattice;
  std::array<int, 3> middle{};
  std::array<std::array<double, 3>, 3> weights{};
};

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
  HairSample sample;
  const double share =
      static_cast<double>(kSampleCount) / static_cast<double>(std::max<std::size_t>(1, groom.points.size()));
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
  const Followed followed(geometry);
  HairStencils stencils;
  std::map<std::uint32_t, double> weight_of;
  for (std::size_t p = 0; p < hair.points.size(); ++p) {
    weight_of.clear();
    const GridStencil stencil(geometry.lattice, hair.points[p]);
    for (int n = 0; n < 27; ++n) {
      const double weight = static_cast<double>(hair.blend[p]) * stencil.weight(n);
      followed.add(stencil.node(n), weight, weight_of);
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
