#include "core/levels/ether.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet {
namespace {

constexpr double kGravity = 9.81;           // m/s^2
constexpr double kHangLengthDefault = 0.1;  // m, in a groom without any hair
constexpr double kEtherMassMin = 1e-6;      // kg, the total in a groom without any hair

// Sums of NodeShares over some nodes.
struct HairSum {
  double mass = 0, hang = 0, gel = 0, damping = 0;

  void add(const NodeShares& shares, std::uint32_t node) {
    mass += shares.mass[node];
    hang += shares.hang_moment[node];
    gel += shares.gel_moment[node];
    damping += shares.ether_damping_moment[node];
  }
};

HairSum hair_around(const Lattice& lattice, const NodeShares& shares, std::uint32_t node) {
  const auto [ci, cj, ck] = lattice.coordinates(node);
  HairSum sum;
  for (int k = std::max(ck - 1, 0); k <= std::min(ck + 1, lattice.dims[2] - 1); ++k) {
    for (int j = std::max(cj - 1, 0); j <= std::min(cj + 1, lattice.dims[1] - 1); ++j) {
      for (int i = std::max(ci - 1, 0); i <= std::min(ci + 1, lattice.dims[0] - 1); ++i) {
        sum.add(shares, lattice.index(i, j, k));
      }
    }
  }
  return sum;
}

HairSum all_hair(const NodeShares& shares) {
  HairSum sum;
  for (std::uint32_t node = 0; node < shares.mass.size(); ++node) sum.add(shares, node);
  const Material normal;
  return sum.mass > 0 ? sum : HairSum{1, kHangLengthDefault, 0, static_cast<double>(normal.ether_damping_ratio)};
}

}  // namespace

NodeMechanics fill_ether(const LevelGeometry& geometry, const NodeShares& shares) {
  const HairSum all = all_hair(shares);
  const double ether_mass = std::max(shares.ether_mass, kEtherMassMin);
  NodeMechanics mechanics;
  for (const std::uint32_t node : geometry.active_nodes) {
    HairSum hair;
    hair.add(shares, node);
    if (!(hair.mass > 0)) hair = hair_around(geometry.lattice, shares, node);
    if (!(hair.mass > 0)) hair = all;
    const double mass = shares.mass[node] + ether_mass / static_cast<double>(geometry.active_nodes.size());
    const double stiffness = mass * (kGravity * hair.mass / hair.hang + hair.gel / hair.mass);
    mechanics.mass.push_back(mass);
    mechanics.ether_stiffness.push_back(stiffness);
    mechanics.ether_damping.push_back(2 * hair.damping / hair.mass * std::sqrt(stiffness * mass));
  }
  return mechanics;
}

}  // namespace hairnet
