#include "core/solver/contact_list.hpp"

#include <algorithm>

#include "core/assert.hpp"
#include "core/skin/skin_distance_field.hpp"
#include "core/solver/contact.hpp"
#include "core/solver/contact_path.hpp"

namespace hairnet {
std::vector<Contact> find_contacts(const Level& level, const StepInput& input, const WorldLattice& lattice) {
  const ContactPoints& points = level.contacts;
  HAIRNET_ASSERT(lattice.P.size() == level.rest.size());
  HAIRNET_ASSERT(lattice.P_dot.size() == level.rest.size());
  HAIRNET_ASSERT(points.begin.size() == points.count() + 1);
  HAIRNET_ASSERT(points.limit.size() == points.count() * level.skin->size());
  const double h = input.step_s, scale = contact_scale(input);
  std::vector<Contact> contacts;
  for (std::size_t p = 0; p < points.count(); ++p) {
    const ContactPath path = contact_path(level, input, lattice, p);
    for (std::size_t f = 0; f < level.skin->size(); ++f) {
      const SkinDistanceField& field = (*level.skin)[f];
      const double limit = double{points.limit[f * points.count() + p]};
      if (limit <= double{kContactNever_m}) continue;
      const RigidTransform &bone_from = input.from[field.bone], &bone_to = input.to[field.bone];
      const RigidTransform back = bone_to.inverse();
      // The force is evaluated where the point would be if it moved with the bone, so a body at constant velocity
      // exerts none.
      const Vec3 with_bone = bone_to.point(bone_from.inverse().point(path.from));
      const Vec3 at = back.point(with_bone), travel = back.point(path.ahead) - at;
      Vec3 gradient;
      const double depth = limit - skin_distance(field, at, &gradient);
      const Vec3 normal = gradient / std::max(gradient.norm(), 1e-6);
      const double ahead = depth - normal.dot(travel);
      // The tangent plane alone would catch hair that flies past a round body. Two more distances, at half of the way
      // and at its end, say whether the skin is there.
      const bool comes_in =
          ahead > 0 && std::min(skin_distance(field, at + travel / 2), skin_distance(field, at + travel)) < limit;
      if (!(depth > 0) && !comes_in) continue;
      const ContactLaw law = contact_law(scale * double{points.potential[p]}, depth, ahead, h);
      const Vec3 out = bone_to.vector(normal);
      contacts.push_back(
          {p, out, law.force - law.stiffness * out.dot(path.with_head - with_bone), path.weight * law.stiffness});
    }
  }
  return contacts;
}

}  // namespace hairnet
