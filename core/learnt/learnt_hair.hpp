#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/learnt/pose_inputs.hpp"

namespace hairnet {

// These limits size arrays on the stack of a step, and bound what a file may ask for.
inline constexpr std::size_t kLearntHiddenMax = 128, kLearntModesMax = 128;
// Characters that are evaluated side by side.
inline constexpr int kLearntWidth = 16;
// The greatest size of a weight: no sum is then infinite.
inline constexpr float kLearntWeightMax = 1e6f;
// For so long a network that begins sees the first pose held: hair that joins late starts as if the head had stood
// still.
inline constexpr int kLearntStart_ticks = 30;
// The longest gap between two poses over which they are interpolated; after a longer one a network begins again.
inline constexpr int kLearntGapMax_ticks = 8;
// After so long it hardly matters when a network has begun: its state forgets within two seconds (at most 2.4 mm RMS in
// 68 of 70 clips, 24 mm in the worst). The state need not be sent therefore: servers send coefficients for so long,
// then poses alone.
inline constexpr int kLearntSettled_ticks = 60;

// The velocity of the air at the head, in its axes, m/s.
inline constexpr std::size_t kAirInputCount = 3;

// What learnt hair knows of wind. Servers alone have it: clients evaluate hair in still air.
struct LearntWind {
  // Has Zu, Nu and Ru: [3 hidden][kAirInputCount]. Empty means that the hair holds in still air alone.
  std::vector<float> weights;
  // Is the fastest air in the training motions.
  float max_m_per_s = 0;
  // Are errors as those of LearntHair, in wind.
  float error = 0, low_error = 0;
};

// The hair of one groom as a small recurrent network: from poses, and the wind, to the first coefficients of the
// groom's basis. For the groom as it was built. Rows of matrices follow each other. Immutable; all threads may share
// it.
//
//     z = s(Z x + Zu u + Z' h + z0)              how much each hidden number moves, s(a) = (1 + f(a)) / 2
//     r = s(R x + Ru u + R' h + r0)              how much it follows the others
//     n = f(N x + Nu u + r N' h + n0) - f(n0)    where it moves
//     h <- h + z (n - h),       c = C h
//     f(a) = a (27 + a^2) / (27 + 9 a^2)         a limited to -3 .. 3
//
// x are the PoseInputs, u the velocity of the air, h the hidden numbers and c the coefficients (m). At rest in still
// air x, u, h and c are exactly zero.
struct LearntHair {
  // Are multiples of 4.
  std::size_t hidden_count = 0, mode_count = 0;
  // Has Z, N and R: [3 hidden][input].
  std::vector<float> input_weights;
  // Has Z', N' and R': [3 hidden][hidden].
  std::vector<float> hidden_weights;
  // Has z0, n0 and r0: [3 hidden].
  std::vector<float> bias;
  // Has C: [mode][hidden].
  std::vector<float> output_weights;
  // Is the greatest size of each input in the training motions.
  PoseInputs most{};
  // Are the errors of this hair and of the low level from the finest, over its motion; measured on validation motions
  // in still air.
  float error = 0, low_error = 0;
  LearntWind wind;

  // Whether these inputs were met in training. Others are evaluated too, but the hair may be far off.
  [[nodiscard]] bool covers(const PoseInputs& inputs) const;
  [[nodiscard]] bool covers_air(double speed_m_per_s) const;
  // Counts the memory of the weights.
  [[nodiscard]] std::size_t bytes() const;
};

// Returns an empty string when counts agree and all weights are within kLearntWeightMax; else one line about the error.
std::string validate(const LearntHair& hair);

// What one character remembers. It may begin at any time: after two seconds it hardly differs from one that began
// earlier.
struct LearntState {
  PoseHistory poses;
  // Empty means zeros.
  std::vector<float> hidden;
};

struct LearntMember {
  LearntState* state = nullptr;
  // Is the pose at kLearntTick_s after the last one.
  const Pose* pose = nullptr;
  // Holds coefficients of the groom's basis, m; those that are not driven become 0.
  std::span<float> coefficients;
  // Is the velocity of the air at the head, m/s; that of carried air is relative to the head's.
  Vec3 air_world = Vec3::Zero();
  // Is Wind::carried.
  bool air_is_carried = false;
  // Is a result: the hair covers the inputs.
  bool is_covered = false;
};

// One tick of at most kLearntWidth characters. The result of a character depends neither on its place nor on the
// others. Asserts that there is room for the driven coefficients.
void step_learnt(const LearntHair& hair, std::span<LearntMember> members);

// The motion of one character from a pose that its network has seen to a later one. A turn of a character in
// World is one motion, and so is the gap between the poses of two frames at a client.
struct LearntMotion {
  LearntState* state = nullptr;
  const Pose *from = nullptr, *to = nullptr;
  // Counts the ticks from `from` to `to`; poses between them are interpolated.
  int ticks = 1;
  // The network sees `from` held for kLearntStart_ticks first.
  bool begins = false;
  // Holds the coefficients at `to`; is unchanged when there is nothing to see.
  std::span<float> coefficients;
  // Velocities of the air at the head, m/s: at `from`, which counts when the network begins, then at each tick. Empty:
  // still air.
  std::span<const Vec3> air_world = {};
  bool air_is_carried = false;
  // Is a result: the hair covers all poses after `from`.
  bool is_covered = true;
};

// Steps at most kLearntWidth characters through their motions. The result of a character does not depend on the others.
void step_learnt(const LearntHair& hair, std::span<LearntMotion> motions);

}  // namespace hairnet
