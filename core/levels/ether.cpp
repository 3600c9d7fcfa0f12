#include "core/levels/ether.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"
#include "core/gravity.hpp"

namespace hairnet {
namespace {

// The hanging length in a groom without hair, m.
constexpr double kHangLengthDefault = 0.1;
// The least mass of all ether together, kg, which a groom without hair gets.
constexpr double kEtherMassMin = 1e-6;

// Sums of LumpedHair over some nodes: the mass, and the moments that are means when they are divided by it.
struct LumpedSum {
  double mass = 0, hang = 0, gel = 0, damping = 0;

  void add(const LumpedHair& lumped, std::uint32_t node) {
    mass += lumped.mass[node];
    hang += lumped.hang_moment[node];
    gel += lumped.gel_moment[node];
    damping += lumped.ether_damping_moment[node];
  }
};

// The sums over the 27 nodes about a node.
LumpedSum hair_around(const Lattice& lattice, const LumpedHair& lumped, std::uint32_t node) {
  HAIRNET_ASSERT(node < lattice.node_count());
  const auto [ci, cj, ck] = lattice.coordinates(node);
  LumpedSum sum;
  for (int k = std::max(ck - 1, 0); k <= std::min(ck + 1, lattice.dims[2] - 1); ++k) {
    for (int j = std::max(cj - 1, 0); j <= std::min(cj + 1, lattice.dims[1] - 1); ++j) {
      for (int i = std::max(ci - 1, 0); i <= std::min(ci + 1, lattice.dims[0] - 1); ++i) {
        sum.add(lumped, lattice.index(i, j, k));
      }
    }
  }
  return sum;
}

// The sums over all nodes, or stand-ins of mass 1 for a groom without hair.
LumpedSum all_hair(const LumpedHair& lumped) {
  LumpedSum sum;
  for (std::uint32_t node = 0; node < lumped.mass.size(); ++node) sum.add(lumped, node);
  const Material normal;
  return sum.mass > 0 ? sum : LumpedSum{1, kHangLengthDefault, 0, static_cast<double>(normal.ether_damping_ratio)};
}

}  // namespace

NodeMechanics fill_ether(const LevelGeometry& geometry, const LumpedHair& lumped) {
  HAIRNET_ASSERT(lumped.mass.size() == geometry.lattice.node_count());
  HAIRNET_ASSERT(lumped.hang_moment.size() == lumped.mass.size());
  HAIRNET_ASSERT(lumped.ether_mass >= 0);
  const LumpedSum all = all_hair(lumped);
  const double ether_mass = std::max(lumped.ether_mass, kEtherMassMin);
  NodeMechanics mechanics;
  for (const std::uint32_t node : geometry.active_nodes) {
    LumpedSum hair;
    hair.add(lumped, node);
    if (!(hair.mass > 0)) hair = hair_around(geometry.lattice, lumped, node);
    if (!(hair.mass > 0)) hair = all;
    HAIRNET_ASSERT(hair.mass > 0);
    HAIRNET_ASSERT(hair.hang >= 0.999 * kHangLengthMin * hair.mass);
    HAIRNET_ASSERT(hair.gel >= 0);
    // Every active node has some mass, as a node without mass would make the system singular.
    const double mass = lumped.mass[node] + ether_mass / static_cast<double>(geometry.active_nodes.size());
    const double stiffness = mass * (kGravity_m_per_s2 * hair.mass / hair.hang + hair.gel / hair.mass);
    mechanics.mass.push_back(mass);
    mechanics.ether_stiffness.push_back(stiffness);
    mechanics.ether_damping.push_back(2 * hair.damping / hair.mass * std::sqrt(stiffness * mass));
  }
  HAIRNET_ASSERT(mechanics.mass.size() == geometry.active_nodes.size());
  HAIRNET_VALIDATE(std::ranges::all_of(mechanics.mass, [](double mass) { return mass > 0; }));
  HAIRNET_VALIDATE(std::ranges::all_of(mechanics.ether_stiffness, [](double stiffness) { return stiffness > 0; }));
  HAIRNET_VALIDATE(std::ranges::all_of(mechanics.ether_damping, [](double damping) { return damping >= 0; }));
  return mechanics;
}

}  // namespace hairnet
