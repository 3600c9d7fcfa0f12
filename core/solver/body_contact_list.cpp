#include "core/solver/body_contact_list.hpp"

#include <algorithm>

#include "core/assert.hpp"
#include "core/solver/body_contact.hpp"
#include "core/solver/contact.hpp"
#include "core/solver/contact_path.hpp"

namespace hairnet {
namespace {

// Whether a point that travels from `at` by `travel` comes nearer to the surface than kTouchReach_m; at the start it is
// farther. Own axes of the shape.
bool comes_in(const TouchShape& shape, const Vec3& at, const Vec3& travel) {
  const double way = travel.norm();
  if (!(way > 0)) return false;
  double share = 0, beyond = shape_distance(shape, at) - kTouchReach_m;
  for (int place = 0; place < kSweepPlaces; ++place) {
    share = std::min(share + std::max(beyond / way, kSweepShareMin), 1.0);
    beyond = shape_distance(shape, at + share * travel) - kTouchReach_m;
    if (beyond < 0) return true;
  }
  return false;
}

}  // namespace

std::vector<BodyContact> find_body_contacts(const Level& level, const StepInput& input, const WorldLattice& lattice) {
  HAIRNET_ASSERT(lattice.P.size() == level.rest.size());
  HAIRNET_ASSERT(lattice.P_dot.size() == level.rest.size());
  std::vector<BodyContact> contacts;
  if (!input.touch) return contacts;
  const double h = input.step_s, scale = contact_scale(input);
  for (std::size_t p = 0; p < level.contacts.count(); ++p) {
    const ContactPath path = contact_path(level, input, lattice, p);
    for (const StepBody& body : input.touch->bodies) {
      const Vec3 at = body.from.inverse().point(path.from), travel = body.to.inverse().point(path.ahead) - at;
      Vec3 normal;
      // The normal at the start serves the whole step. A body at constant velocity exerts no force, since `travel` is
      // measured in the body's own axes.
      const double depth = kTouchReach_m - shape_distance(body.shape, at, &normal);
      const double ahead = depth - normal.dot(travel);
      if (!(depth > 0) && !(ahead > 0 && comes_in(body.shape, at, travel))) continue;
      const ContactLaw law = contact_law(scale * double{level.contacts.potential[p]}, depth, ahead, h);
      const double along_m = (travel - normal.dot(travel) * normal).norm();
      const double friction = friction_viscosity(body.friction, law.force, along_m / h);
      const Vec3 out = body.to.vector(normal);
      // Across the surface the contact is a stiffness; along the surface friction is a viscosity, which over a step of
      // h acts like the stiffness friction / h.
      const Mat3 K = law.stiffness * out * out.transpose() + friction / h * (Mat3::Identity() - out * out.transpose());
      const Vec3 with_body = body.to.point(at);
      contacts.push_back({p, law.force * out - K * (path.with_head - with_body), path.weight * K});
    }
  }
  return contacts;
}

}  // namespace hairnet
