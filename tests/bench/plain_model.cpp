#include "tests/bench/plain_model.hpp"

#include <algorithm>

#include "core/assert.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/node_terms.hpp"

namespace hairnet::bench {
namespace {

PlainTransform plain(const RigidTransform& t) {
  PlainTransform out;
  const Mat3 R = t.rotation.toRotationMatrix();
  std::copy_n(R.data(), 9, out.rotation);
  std::copy_n(t.position.data(), 3, out.position);
  return out;
}

}  // namespace

PlainModel::PlainModel(const Level& level, double step_s, const MaterialScale& material) {
  plain_.node_count = level.rest.size();
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    for (int a = 0; a < 3; ++a) rest_.push_back(level.rest[i][a]);
    for (const float q : level.drag[i]) drag_.push_back(material.air_drag * q);
    mass_.push_back(node_mass(level, material, i));
    ether_stiffness_.push_back(ether_stiffness(level, material, i));
    ether_damping_.push_back(ether_damping(level, material, i, static_cast<float>(step_s)));
  }
  std::size_t f = 0;
  for (const SkinDistanceField& field : *level.skin) {
    PlainSkinDistanceField& out = skin_.emplace_back();
    for (std::size_t a = 0; a < 3; ++a) {
      out.origin[a] = field.origin[static_cast<Eigen::Index>(a)];
      out.dims[a] = field.dims[a];
    }
    out.cell_m = field.cell_m;
    out.distance = field.distance.data();
    // The level has the limits of all contact points for the first field, then those for the second one, and so on.
    out.limit = level.contacts.limit.data() + f++ * level.contacts.count();
  }
  plain_.rest = rest_.data();
  plain_.mass = mass_.data();
  plain_.ether_stiffness = ether_stiffness_.data();
  plain_.ether_damping = ether_damping_.data();
  plain_.drag = drag_.data();
  plain_.skin = skin_.data();
  plain_.skin_count = skin_.size();
  const ContactPoints& contacts = level.contacts;
  plain_.contacts = {contacts.count(),
                     contacts.begin.data(),
                     contacts.nodes.data(),
                     contacts.weights.data(),
                     contacts.count() > 0 ? contacts.rest.front().data() : nullptr,
                     contacts.potential.data()};
  // PlainStiffeners gets pointers into the vectors of `springs_`, so their sizes must not change from here on.
  take(level.springs, step_s, material, springs_, plain_.springs);
  // A spring's viscosity goes with its strain.
  for (std::size_t s = 0; s < level.springs.count(); ++s)
    springs_.damping[s] = material.damping * level.springs.damping[s];
  take(level.attachments, step_s, material, attachments_, plain_.attachments);
}

void PlainModel::take(const Stiffeners& stiffeners, double step_s, const MaterialScale& material, Terms& terms,
                      PlainStiffeners& plain) {
  terms.weights.assign(stiffeners.weights.begin(), stiffeners.weights.end());
  for (std::size_t s = 0; s < stiffeners.count(); ++s) {
    const auto [k, q] = stiffener_terms(stiffeners, material, s, static_cast<float>(step_s));
    terms.stiffness.push_back(k);
    terms.damping.push_back(q);
    terms.rest_length.push_back(stiffeners.rest[s].cast<double>().norm());
  }
  plain = {stiffeners.count(),     stiffeners.begin.data(), stiffeners.nodes.data(), terms.weights.data(),
           terms.stiffness.data(), terms.damping.data(),    terms.rest_length.data()};
}

PlainStep::PlainStep(const Level& level, const StepInput& input) : input_{} {
  HAIRNET_ASSERT(!input.environment->wind.acts());
  input_.step_s = input.step_s;
  input_.head_from = plain(input.from.head());
  input_.head_to = plain(input.to.head());
  std::copy_n(input.environment->gravity.data(), 3, input_.gravity);
  std::copy_n(kDesignGravity.data(), 3, input_.design_gravity);
  input_.contact_release = input.contact_release;
  for (const SkinDistanceField& field : *level.skin) {
    const RigidTransform &from = input.from[field.bone], &to = input.to[field.bone];
    // The two inverses take points of the world into the rest pose, with the bone at the beginning and at the end of
    // the step. The last transform takes them back.
    bones_.push_back({plain(from.inverse()), plain(to.inverse()), plain(to)});
  }
}

PlainInput PlainStep::input() const {
  PlainInput input = input_;
  input.bones = bones_.data();
  return input;
}

}  // namespace hairnet::bench
