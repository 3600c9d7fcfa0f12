#include "tests/bench/plain_model.hpp"

#include <algorithm>
#include <cassert>

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
  for (const Metaball& ball : level.metaballs) {
    for (std::size_t i = 0; i < level.rest.size(); ++i) {
      ball_radius_.push_back(ball.radius[i]);
      ball_potential_.push_back(contact_potential(ball, material, i));
    }
  }
  plain_.rest = rest_.data();
  plain_.mass = mass_.data();
  plain_.ether_stiffness = ether_stiffness_.data();
  plain_.ether_damping = ether_damping_.data();
  plain_.drag = drag_.data();
  plain_.ball_count = level.metaballs.size();
  plain_.ball_radius = ball_radius_.data();
  plain_.ball_potential = ball_potential_.data();
  take(level.springs, step_s, material, springs_, plain_.springs);
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
  assert(input.environment->wind.is_still());
  input_.step_s = input.step_s;
  input_.head_from = plain(input.from.head());
  input_.head_to = plain(input.to.head());
  std::copy_n(input.environment->gravity.data(), 3, input_.gravity);
  std::copy_n(kDesignGravity.data(), 3, input_.design_gravity);
  input_.contact_release = input.contact_release;
  for (const Metaball& ball : level.metaballs) {
    PlainBall& out = balls_.emplace_back();
    out.carry = plain(input.to[ball.bone] * input.from[ball.bone].inverse());
    const Vec3 centre = input.to[ball.bone].point(ball.centre.cast<double>());
    std::copy_n(centre.data(), 3, out.centre);
  }
}

PlainInput PlainStep::input() const {
  PlainInput input = input_;
  input.balls = balls_.data();
  return input;
}

}  // namespace hairnet::bench
