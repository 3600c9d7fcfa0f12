#include "client/assets/made/tied.hpp"

#include <algorithm>
#include <cmath>

#include "client/assets/made/easing.hpp"

namespace hairnet::made {

Vec3 Tie::on_ring(double angle, double radius_m_at) const {
  return centre + radius_m_at * (std::sin(angle) * Vec3::UnitX() + std::cos(angle) * down());
}

// Roots behind the ears or above them are pulled back. The bust's ears lie about in front of z = -1.2 cm and below y =
// 6.6 cm.
bool is_pulled_back(const Vec3& root) {
  return root.z() < -0.012 || root.y() > 0.066;
}

Path pulled(const Root& root, const Tie& tie, Random& random) {
  const Vec3 across = root.point - tie.centre;
  // Each strand goes to the side of the tie that is next to it, with a little disorder.
  const double angle = std::atan2(across.dot(Vec3::UnitX()), across.dot(tie.down())) + 0.12 * random.symmetric();
  // Strands end in the outer half of the tie's radius.
  const Vec3 goal = tie.on_ring(angle, tie.radius_m * std::sqrt(random.between(0.25, 1.0)));
  const double far = (root.point - goal).norm();
  // Hair near the tie must not be lifted, as it would be above the ring.
  const double lift = random.between(0.0015, 0.0065) * smootherstep(0.0, 0.1, far) + 0.0015;
  const Vec3 stray = 0.05 * Vec3(random.symmetric(), random.symmetric(), random.symmetric());
  Growth growth;
  growth.start = root.point;
  // The length is only a limit: done() ends the strand 5 mm from its place in the tie.
  growth.length_m = 0.6;
  growth.step_m = 0.004;
  // The strand bends within 8 mm, because taut hair turns at once.
  growth.bend_m = 0.008;
  growth.spares_face = false;
  growth.preferred_direction = [goal, stray](const GrowthPoint& at) {
    const Vec3 to = goal - at.p;
    return Vec3(to.normalized() + stray * std::exp(-at.s / 0.05));
  };
  // It rises a little from the skin before it follows the pull.
  growth.direction = 0.35 * root.normal + (goal - root.point).normalized();
  growth.clearance = [lift](const Vec3&, double s) { return std::min(0.5 * s, lift * (1 - std::exp(-s / 0.02))); };
  growth.done = [goal](const Vec3& p, double) { return (goal - p).norm() < 0.005; };
  Path path = grow(growth);
  // The last point lies exactly in the tie.
  path.push_back(goal + 0.004 * tie.axis);
  return path;
}

void add_knot(Groom& groom, std::vector<std::uint32_t> tied, double stiffness_n_per_m) {
  if (tied.size() < 2) return;
  Knot knot;
  knot.points = std::move(tied);
  knot.stiffness_n_per_m = static_cast<float>(stiffness_n_per_m);
  groom.knots.push_back(std::move(knot));
}

}  // namespace hairnet::made
