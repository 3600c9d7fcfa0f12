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
// its hair plus a residual, which frames with coefficients set and which decays while there are none; so a frame
// without coefficients continues a frame with them. When coefficients come after frames without them, the server's hair
// may lie elsewhere than the shown hair. The difference, called surprise here, is added to what is shown, and decays.
class LearntTrack {
 public:
  // The motion that the network must be stepped through for this frame; none: there is nothing to step. `hair`: null
  // when the groom's is not here. The motion refers to this and to the poses.
  std::optional<LearntMotion> begin(std::shared_ptr<const LearntHair> hair, const LearntFrame& frame);
  // Call it after the step. `coefficients` (m) are those of the frame, and become those to show. `before` are those
  // that were shown with the frame before; empty: none were.
  void finish(const LearntFrame& frame, std::span<const float> before, std::span<float> coefficients);
  [[nodiscard]] const LearntHair* hair() const { return hair_.get(); }
  // Whether the network has begun so late that it has not settled: a frame without coefficients is then too early,
  // which the server cannot know.
  [[nodiscard]] bool is_unsettled() const {
    return has_begun_ && followed_ticks_ < kLearntSettled_ticks - kLearntGapMax_ticks;
  }
  // Whether frames of other levels are shown as they are.
  [[nodiscard]] bool is_idle() const { return !hair_ && surprise_.empty(); }

 private:
  // Is null while the network does not run.
  std::shared_ptr<const LearntHair> hair_;
  LearntState state_;
  // Holds the coefficients that the network gave at the last frame.
  std::vector<float> evaluated_;
  // Holds the shown coefficients minus evaluated_; empty means zero.
  std::vector<float> residual_;
  // Holds the shown coefficients minus those of the server's frame; empty means zero.
  std::vector<float> surprise_;
  // has_begun_: the network has seen a pose. is_new_: it has seen its first one at this frame.
  bool has_begun_ = false, is_new_ = false;
  // The last frame had no coefficients.
  bool was_evaluated_ = false;
  // Counts the ticks since the network began.
  std::uint64_t followed_ticks_ = 0;
};

}  // namespace hairnet::link
