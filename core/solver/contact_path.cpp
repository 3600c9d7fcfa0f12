#include "core/solver/contact_path.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet {

ContactPath contact_path(const Level& level, const StepInput& input, const WorldLattice& lattice, std::size_t point) {
  const ContactPoints& points = level.contacts;
  HAIRNET_ASSERT(point < points.count());
  HAIRNET_VALIDATE(points.begin[point] <= points.begin[point + 1]);
  const RigidTransform &from = input.from.head(), &to = input.to.head();
  ContactPath path;
  Vec3 displacement = Vec3::Zero(), velocity = Vec3::Zero();
  for (std::uint32_t e = points.begin[point]; e < points.begin[point + 1]; ++e) {
    const std::size_t i = points.nodes[e];
    const double weight = double{points.weights[e]};
    const Vec3 rest = level.rest[i].cast<double>();
    // Both sums are relative to the rest. The weights of a point near its root sum to less than 1, and the root blend
    // moves the rest of the point with the head.
    displacement += weight * (lattice.P[i] - from.point(rest));
    velocity += weight * (lattice.P_dot[i] - (to.point(rest) - from.point(rest)) / input.step_s);
    path.weight += weight;
  }
  const Vec3 rest = points.rest[point].cast<double>();
  path.from = from.point(rest) + displacement;
  path.with_head = to.point(rest) + displacement;
  path.ahead = path.with_head + input.step_s * velocity;
  return path;
}

double contact_scale(const StepInput& input) {
  HAIRNET_ASSERT(input.contact_release >= 0);
  HAIRNET_ASSERT(input.contact_release <= 1);
  // Denser hair presses harder, so its contact is as much harder; lighter hair keeps the built potential.
  return (1 - input.contact_release) * double{std::max(input.material.density, 1.0f)};
}

}  // namespace hairnet
