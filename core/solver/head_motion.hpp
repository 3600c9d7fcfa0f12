#pragma once

#include <vector>

#include "core/assert.hpp"
#include "core/levels/level.hpp"
#include "core/solver/step.hpp"

namespace hairnet {

// Gravity that the rest shape already includes, m/s^2, head axes (core/README.md, Gravity).
extern const Vec3 kDesignGravity;

// The motion of the head during one step, in the axes of the head at its end. Differences of positions are taken in
// double first, so that precision does not depend on the distance from the world's origin.
struct HeadMotion {
  explicit HeadMotion(const StepInput& input)
      : relative(input.to.head().inverse() * input.from.head()),
        turn(relative.rotation.toRotationMatrix()),
        rotation_less_identity(turn - Mat3::Identity()),
        step_s(input.step_s),
        gravity_load(input.to.head().rotation.conjugate() * input.environment->gravity - kDesignGravity) {
    HAIRNET_ASSERT(step_s > 0);
  }

  // R' p^0 = (B_1 p^0 - B_0 p^0) / h: the velocity of a point that moves rigidly with the head.
  [[nodiscard]] Vec3 rigid_velocity(const Vec3& rest) const {
    // In the axes at the end of the step, B_1 p^0 is p^0 and B_0 p^0 is turn p^0 + position.
    return -(rotation_less_identity * rest + relative.position) / step_s;
  }

  // The velocity of the head's joint, m/s.
  [[nodiscard]] Vec3 velocity() const { return relative.position / -step_s; }

  // The map from head space at the start of the step to head space at its end.
  RigidTransform relative;
  Mat3 turn, rotation_less_identity;
  double step_s;
  // Gravity without the part that the design includes, g - R g_0, in axes of the head, m/s^2.
  Vec3 gravity_load;
};

// The place at the end of the step of a point that is fixed to `bone` at rest, head space.
inline Vec3 posed(const StepInput& input, Bone bone, const Vec3& rest) {
  if (bone == Bone::head) return rest;
  return (input.to.head().inverse() * input.to[bone]).point(rest);
}

}  // namespace hairnet
