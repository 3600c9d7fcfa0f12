#include "core/solver/contact_list.hpp"

#include <algorithm>

#include "core/assert.hpp"
#include "core/skin/skin_distance_field.hpp"
#include "core/solver/contact.hpp"
#include "core/solver/node_terms.hpp"

namespace hairnet {
namespace {

// The place of a contact point at the start of a step, and where it would end with the head and by its own velocity;
// world.
struct Path {
  Vec3 from, with_head, ahead;
  double weight = 0;  // the sum of its nodes' weights
};

Path path_of(const Level& level, const StepInput& input, const WorldLattice& lattice, std::size_t p) {
  const ContactPoints& points = level.contacts;
  HAIRNET_VALIDATE(points.begin[p] <= points.begin[p + 1]);
  const RigidTransform &from = input.from.head(), &to = input.to.head();
  Path path;
  Vec3 displacement = Vec3::Zero(), velocity = Vec3::Zero();
  for (std::uint32_t e = points.begin[p]; e < points.begin[p + 1]; ++e) {
    const std::size_t i = points.nodes[e];
    const double weight = double{points.weights[e]};
    const Vec3 rest = level.rest[i].cast<double>();
    displacement += weight * (lattice.P[i] - from.point(rest));
    velocity += weight * (lattice.P_dot[i] - (to.point(rest) - from.point(rest)) / input.step_s);
    path.weight += weight;
  }
  const Vec3 rest = points.rest[p].cast<double>();
  path.from = from.point(rest) + displacement;
  path.with_head = to.point(rest) + displacement;
  path.ahead = path.with_head + input.step_s * velocity;
  return path;
}

}  // namespace

std::vector<Contact> find_contacts(const Level& level, const StepInput& input, const WorldLattice& lattice) {
  const ContactPoints& points = level.contacts;
  HAIRNET_ASSERT(lattice.P.size() == level.rest.size());
  HAIRNET_ASSERT(lattice.P_dot.size() == level.rest.size());
  HAIRNET_ASSERT(points.begin.size() == points.count() + 1);
  HAIRNET_ASSERT(points.limit.size() == points.count() * level.skin->size());
  HAIRNET_ASSERT(input.contact_release >= 0);
  HAIRNET_ASSERT(input.contact_release <= 1);
  const double h = input.step_s;
  const double scale = (1 - input.contact_release) * double{std::max(input.material.density, 1.0f)};
  std::vector<Contact> contacts;
  for (std::size_t p = 0; p < points.count(); ++p) {
    const Path path = path_of(level, input, lattice, p);
    for (std::size_t f = 0; f < level.skin->size(); ++f) {
      const SkinDistanceField& field = (*level.skin)[f];
      const double limit = double{points.limit[f * points.count() + p]};
      if (limit <= double{kContactNever_m}) continue;
      const RigidTransform &bone_from = input.from[field.bone], &bone_to = input.to[field.bone];
      const RigidTransform back = bone_to.inverse();
      const Vec3 with_bone = bone_to.point(bone_from.inverse().point(path.from));
      const Vec3 at = back.point(with_bone), travel = back.point(path.ahead) - at;
      Vec3 gradient;
      const double depth = limit - skin_distance(field, at, &gradient);
      const Vec3 normal = gradient / std::max(gradient.norm(), 1e-6);
      const double ahead = depth - normal.dot(travel);
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
