#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/learnt/pose_inputs.hpp"

namespace hairnet {

inline constexpr std::size_t kLearntHiddenMax = 128, kLearntModesMax = 128;
inline constexpr int kLearntWidth = 16;          // characters that are evaluated side by side
inline constexpr float kLearntWeightMax = 1e6f;  // the greatest size of a weight: no sum is then infinite
inline constexpr int kLearntStart_ticks = 30;    // for which a network that begins sees the first pose held
inline constexpr int kLearntGapMax_ticks = 8;    // between two poses; after a longer gap a network begins again
inline constexpr int kLearntSettled_ticks = 60;  // after which it hardly matters when a network has begun

// The hair of one groom as a small recurrent network: from poses to the first coefficients of the groom's basis. For
// the groom as it was built, in still air. Rows of matrices follow each other. Immutable; all threads may share it.
//
//     z = s(Z x + Z' h + z0)                  how much each hidden number moves, s(a) = (1 + f(a)) / 2
//     r = s(R x + R' h + r0)                  how much it follows the others
//     n = f(N x + r N' h + n0) - f(n0)        where it moves
//     h <- h + z (n - h),       c = C h
//
// x are the PoseInputs, h the hidden numbers and c the coefficients (m). At rest x, h and c are exactly zero.
struct LearntHair {
  std::size_t hidden_count = 0, mode_count = 0;  // multiples of 4
  std::vector<float> input_weights;              // Z, N, R: [3 hidden][input]
  std::vector<float> hidden_weights;             // Z', N', R': [3 hidden][hidden]
  std::vector<float> bias;                       // z0, n0, r0: [3 hidden]
  std::vector<float> output_weights;             // C: [mode][hidden]
  PoseInputs most{};                             // the greatest size of each input in the training motions
  float error = 0, low_error = 0;  // of this and of the low level from the finest, over its motion; on held-out motions

  // Whether these inputs were met in training. Others are evaluated too, but the hair may be far off.
  [[nodiscard]] bool covers(const PoseInputs& inputs) const;
  [[nodiscard]] std::size_t bytes() const;  // of weights
};

// Returns an empty string when counts agree and all weights are within kLearntWeightMax; else one line about the fault.
std::string validate(const LearntHair& hair);

// What one character remembers. It may begin at any time: after two seconds it hardly differs from one that began
// earlier.
struct LearntState {
  PoseHistory poses;
  std::vector<float> hidden;  // empty: zeros
};

struct LearntMember {
  LearntState* state = nullptr;
  const Pose* pose = nullptr;     // kLearntTick_s after the last
  std::span<float> coefficients;  // of the groom's basis, m; those that are not driven become 0
  bool is_covered = false;        // result: the hair covers the inputs
};

// One tick of at most kLearntWidth characters. The result of a character depends neither on its place nor on the
// others. Asserts that there is room for the driven coefficients.
void step_learnt(const LearntHair& hair, std::span<LearntMember> members);

// The motion of one character from a pose that its network has seen to a later one.
struct LearntMotion {
  LearntState* state = nullptr;
  const Pose *from = nullptr, *to = nullptr;
  int ticks = 1;                  // from one to the other; poses between them are interpolated
  bool begins = false;            // the network sees `from` held for kLearntStart_ticks first
  std::span<float> coefficients;  // at `to`; unchanged when there is nothing to see
  bool is_covered = true;         // result: the hair covers all poses after `from`
};

// Steps at most kLearntWidth characters through their motions. The result of a character does not depend on the others.
void step_learnt(const LearntHair& hair, std::span<LearntMotion> motions);

}  // namespace hairnet
