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
  // The matrices Zu, Nu and Ru, [3 hidden][kAirInputCount]. Empty means that the hair is good in still air alone.
  std::vector<float> weights;
  // The speed of the fastest air in the training motions, m/s.
  float max_m_per_s = 0;
  // The errors of this hair and of the low level in wind, measured as those of LearntHair.
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
  // The numbers of hidden numbers and of driven modes, both multiples of 4.
  std::size_t hidden_count = 0, mode_count = 0;
  // The matrices Z, N and R, [3 hidden][input].
  std::vector<float> input_weights;
  // The matrices Z', N' and R', [3 hidden][hidden].
  std::vector<float> hidden_weights;
  // The vectors z0, n0 and r0, [3 hidden].
  std::vector<float> bias;
  // The matrix C, [mode][hidden].
  std::vector<float> output_weights;
  // The greatest size of each input in the training motions.
  PoseInputs most{};
  // The errors of this hair and of the low level from the finest, over its motion; measured on validation motions
  // in still air.
  float error = 0, low_error = 0;
  LearntWind wind;

  // Whether these inputs were met in training. Others are evaluated too, but the hair may be far off.
  [[nodiscard]] bool covers(const PoseInputs& inputs) const;
  [[nodiscard]] bool covers_air(double speed_m_per_s) const;
  // The memory that the weights take.
  [[nodiscard]] std::size_t bytes() const;
};

// Returns an empty string when counts agree and all weights are within kLearntWeightMax; else one line about the error.
std::string validate(const LearntHair& hair);

// What one character remembers. It may begin at any time: after two seconds it hardly differs from one that began
// earlier.
struct LearntState {
  PoseHistory poses;
  // The hidden numbers h; empty means zeros.
  std::vector<float> hidden;
};

// One character's input and result of a tick. The caller owns all that it points to.
struct LearntMember {
  LearntState* state = nullptr;
  // The pose kLearntTick_s after the last one that the state has seen.
  const Pose* pose = nullptr;
  // The result: coefficients of the groom's basis, m. Those that the network does not drive become 0.
  std::span<float> coefficients;
  // The velocity of the air at the head, m/s; that of carried air is relative to the head's.
  Vec3 air_world = Vec3::Zero();
  // Whether the air goes along with the head (Wind::carried).
  bool air_is_carried = false;
  // A result: whether the inputs were met in training (LearntHair::covers).
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
  // The ticks of kLearntTick_s from `from` to `to`. The poses between them are interpolated.
  int ticks = 1;
  // The network sees `from` held for kLearntStart_ticks first.
  bool begins = false;
  // The result: the coefficients at `to`, m. They are unchanged when there is nothing to see.
  std::span<float> coefficients;
  // Velocities of the air at the head, m/s: at `from`, which counts when the network begins, then at each tick. Empty:
  // still air.
  std::span<const Vec3> air_world = {};
  bool air_is_carried = false;
  // A result: whether the inputs of all poses after `from` were met in training.
  bool is_covered = true;
};

// Steps at most kLearntWidth characters through their motions. The result of a character does not depend on the others.
void step_learnt(const LearntHair& hair, std::span<LearntMotion> motions);

}  // namespace hairnet
