#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/learnt/learnt_hair.hpp"

namespace hairnet::link {

// What the hair of a member depends on beside the coefficients of its frame.
struct LearntFrame {
  // Is the pose of the frame before; null means that there is none that the hair could continue.
  const Pose* from = nullptr;
  const Pose* to = nullptr;
  // Counts the ticks between the two.
  std::uint64_t ticks = 0;
  // The hair is on the learnt level.
  bool is_learnt = false;
  // The frame comes without coefficients.
  bool evaluated = false;
  bool discontinuous = false;
};

// The hair of one member on the learnt level, from its poses. The network runs from frame to frame. What is shown is
// its hair plus a residual that frames with coefficients set, and that decays while there are none; so a frame without
// coefficients continues one with them. In turn, a frame with coefficients after one without is shown with what it
// surprises by, which decays.
class LearntTrack {
 public:
  // The motion that the network must be stepped through for this frame; none: there is nothing to step. `hair`: null
  // when the groom's is not here. The motion refers to this and to the poses.
  std::optional<LearntMotion> begin(std::shared_ptr<const LearntHair> hair, const LearntFrame& frame);
  // After the step. `coefficients` (m): those of the frame, which are replaced by those to show. `before`: as they were
  // shown with the frame before; empty: they were not.
  void finish(const LearntFrame& frame, std::span<const float> before, std::span<float> coefficients);
  [[nodiscard]] const LearntHair* hair() const { return hair_.get(); }
  // Whether the network has begun so late that a frame without coefficients came too early. The server knows of no gap.
  [[nodiscard]] bool is_unsettled() const {
    return has_begun_ && followed_ticks_ < kLearntSettled_ticks - kLearntGapMax_ticks;
  }
  // Whether frames of other levels are shown as they are.
  [[nodiscard]] bool is_idle() const { return !hair_ && surprise_.empty(); }

 private:
  std::shared_ptr<const LearntHair> hair_;  // null: the track is empty
  LearntState state_;
  std::vector<float> evaluated_;             // by the network, at the last frame
  std::vector<float> residual_;              // shown less evaluated; empty: zero
  std::vector<float> surprise_;              // shown less coded; empty: zero
  bool has_begun_ = false, is_new_ = false;  // the network has seen a pose; at this frame only
  bool was_evaluated_ = false;               // the last frame had no coefficients
  std::uint64_t followed_ticks_ = 0;         // since the network began
};

}  // namespace hairnet::link
