#include "core/build/ether.hpp"

#include <algorithm>
#include <numeric>

namespace hairnet {
namespace {

constexpr double kGravity = 9.81;           // m/s^2
constexpr double kHangLengthDefault = 0.1;  // m, in a groom without any hair
constexpr double kEtherMassMin = 1e-6;      // kg, the total in a groom without any hair

// Mass-weighted mean over the node and those next to it; 0 when none of them has hair.
double hang_length_around(const Lattice& lattice, const NodeShares& shares, std::uint32_t node) {
  const auto [ci, cj, ck] = lattice.coordinates(node);
  double mass = 0, moment = 0;
  for (int k = std::max(ck - 1, 0); k <= std::min(ck + 1, lattice.dims[2] - 1); ++k) {
    for (int j = std::max(cj - 1, 0); j <= std::min(cj + 1, lattice.dims[1] - 1); ++j) {
      for (int i = std::max(ci - 1, 0); i <= std::min(ci + 1, lattice.dims[0] - 1); ++i) {
        const std::uint32_t near = lattice.index(i, j, k);
        mass += shares.mass[near];
        moment += shares.hang_moment[near];
      }
    }
  }
  return mass > 0 ? moment / mass : 0;
}

}  // namespace

NodeMechanics fill_ether(const LevelGeometry& geometry, const NodeShares& shares, const Material& material) {
  const std::size_t node_count = geometry.active_nodes.size();
  const double hair_mass = std::accumulate(shares.mass.begin(), shares.mass.end(), 0.0);
  const double hang_moment = std::accumulate(shares.hang_moment.begin(), shares.hang_moment.end(), 0.0);
  const double hang_length_mean = hair_mass > 0 ? hang_moment / hair_mass : kHangLengthDefault;
  const double ether_mass = std::max(static_cast<double>(material.ether_mass_ratio) * hair_mass, kEtherMassMin);
  const double stiffness_per_mass = static_cast<double>(material.ether_stiffness_n_per_m) / (hair_mass + ether_mass);

  NodeMechanics mechanics;
  for (const std::uint32_t node : geometry.active_nodes) {
    const double mass = shares.mass[node] + ether_mass / static_cast<double>(node_count);
    double hang_length = shares.mass[node] > 0 ? shares.hang_moment[node] / shares.mass[node]
                                               : hang_length_around(geometry.lattice, shares, node);
    if (!(hang_length > 0)) hang_length = hang_length_mean;
    const double stiffness = mass * std::max(kGravity / hang_length, stiffness_per_mass);
    mechanics.mass.push_back(mass);
    mechanics.ether_stiffness.push_back(stiffness);
    mechanics.ether_damping.push_back(stiffness * static_cast<double>(material.ether_damping_time_s));
  }
  return mechanics;
}

}  // namespace hairnet
