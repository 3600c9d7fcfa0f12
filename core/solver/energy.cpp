#include "core/solver/energy.hpp"

#include "core/assert.hpp"
#include "core/solver/node_terms.hpp"
#include "core/solver/spring.hpp"
#include "core/solver/weighted_sum.hpp"

namespace hairnet {
namespace {

double half_square(double k, double x2) {
  return 0.5 * k * x2;
}

}  // namespace

LatticeEnergy energy(const Level& level, const MaterialScale& material, const HeadMotion& motion,
                     const LatticeState& state) {
  HAIRNET_ASSERT(state.displacement.size() == level.rest.size());
  HAIRNET_ASSERT(state.velocity.size() == level.rest.size());
  LatticeEnergy sum;
  std::vector<Vec3> displacement;
  for (const Vec3f& d : state.displacement) displacement.push_back(d.cast<double>());
  const double stiffness = material.stiffness;
  for (std::size_t s = 0; s < level.springs.count(); ++s) {
    const Vec3 delta = weighted_sum(level.springs, s, displacement);
    const double elongation_m = elongation<double>(level.springs.rest[s].cast<double>(), delta);
    sum.elastic_j += spring_energy(stiffness * double{level.springs.stiffness[s]},
                                   level.springs.rest[s].cast<double>().norm(), elongation_m);
  }
  for (std::size_t s = 0; s < level.attachments.count(); ++s) {
    sum.elastic_j += half_square(stiffness * double{level.attachments.stiffness[s]},
                                 weighted_sum(level.attachments, s, displacement).squaredNorm());
  }
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    // At rest in the head's frame all three kinds of elastic energy are zero: the design is the reference of each.
    sum.elastic_j += half_square(ether_stiffness(level, material, i), displacement[i].squaredNorm());
    const Vec3 velocity = state.velocity[i].cast<double>() - motion.rigid_velocity(level.rest[i].cast<double>());
    sum.kinetic_j += half_square(node_mass(level, material, i), velocity.squaredNorm());
  }
  // The negation lets a state pass whose numbers are not finite.
  HAIRNET_ASSERT(!(sum.kinetic_j < 0));
  HAIRNET_ASSERT(!(sum.elastic_j < 0));
  return sum;
}

}  // namespace hairnet
