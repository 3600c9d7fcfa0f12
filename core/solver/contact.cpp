#include "core/solver/contact.hpp"

#include "core/solver/head_motion.hpp"
#include "core/solver/metaball.hpp"

namespace hairnet {

void add_contacts(const Level& level, const StepInput& input, const LatticeState& state, std::span<const Vec3f> carried,
                  std::span<Vec3f> load, std::span<Mat3f> diagonal) {
  const auto h = static_cast<float>(input.step_s);
  for (const Metaball& ball : level.metaballs) {
    const RigidTransform carry = bone_carry(input, ball.bone);
    const Mat3f turn = carry.rotation.toRotationMatrix().cast<float>();
    const Vec3f shift = carry.position.cast<float>();
    const Vec3f centre = posed(input, ball.bone, ball.centre.cast<double>()).cast<float>();
    for (std::size_t i = 0; i < level.rest.size(); ++i) {
      const float rho = ball.radius[i];
      if (rho <= 0) continue;
      const Vec3f with_bone = turn * (level.rest[i] + state.displacement[i]) + shift;
      const Vec3f r = with_bone - centre;
      const float distance = r.norm();
      if (!(distance < rho) || distance <= 0) continue;
      const Vec3f outward = r / distance;
      const float k = metaball_radial_stiffness(ball.potential[i], rho, r);
      const Vec3f otherwise = level.rest[i] + carried[i] - with_bone;
      load[i] += metaball_force(ball.potential[i], rho, r) - k * outward.dot(otherwise) * outward;
      diagonal[i] += (h * h * k) * outward * outward.transpose();
    }
  }
}

}  // namespace hairnet
