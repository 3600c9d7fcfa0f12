#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/touch/touch_shape.hpp"

namespace hairnet {

// A shape that may meet the hair of one character in one step; world. From `from` at the step's start it moves to `to`.
struct StepBody {
  TouchShape shape;
  RigidTransform from, to;
  // Coulomb's coefficient of friction, at least 0.
  double friction = 0;
};

// A contact point of the hair that a hand holds, bound to a place that moves with the hand (eq. 4 with one point).
struct StepHold {
  // The index of a contact point of the level.
  std::uint32_t point = 0;
  // The places where the point is bound to at the step's start and end, world.
  Vec3 from, to;
};

// What touches one character in one step.
struct StepTouch {
  std::span<const StepBody> bodies;
  std::span<const StepHold> holds;
};

// The most bodies and held points in a step of one character. They bound the working memory of a step, and what a crowd
// of hands can cost.
inline constexpr std::size_t kStepBodiesMax = 24, kStepHoldsMax = 128;

// Hair meets a body at this distance from its surface, as it has a thickness.
inline constexpr double kTouchReach_m = 0.005;
// Coulomb's coefficient between hair and a hand or a prop.
inline constexpr double kTouchFriction = 0.5;
// Friction grows with the speed along the surface up to here: so fast does hair creep that it could hold.
inline constexpr double kTouchFrictionSpeed_m_per_s = 0.004;
// A held point's spring, N/m; its viscosity is that times the step's length.
inline constexpr double kHoldStiffness_n_per_m = 100;

}  // namespace hairnet
