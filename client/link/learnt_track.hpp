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
  // The pose of the frame before; null means that there is none that the hair could continue.
  const Pose* from = nullptr;
  const Pose* to = nullptr;
  // The number of ticks between the two.
  std::uint64_t ticks = 0;
  // The hair is on the learnt level.
  bool is_learnt = false;
  // The frame comes without coefficients.
  bool evaluated = false;
  bool discontinuous = false;
};

// The learnt hair of one member. The network (core/learnt) steps from frame to frame, by the poses. The shown
// coefficients are the network's plus a residual. A frame with coefficients sets the residual, and it decays while
// frames have none; so the hair does not jump when frames without coefficients follow. When frames with coefficients
// come again, the server's hair may differ from the shown hair. This difference, called surprise here, is added to what
// is shown, and decays.
class LearntTrack {
 public:
  // Returns the motion by which the network must be stepped for this frame; none: it need not be stepped. `hair` is
  // null when the groom's network is not here. The motion refers to this object and to the poses of `frame`.
  std::optional<LearntMotion> begin(std::shared_ptr<const LearntHair> hair, const LearntFrame& frame);
  // Call it after the step. `coefficients` (m) are those of the frame, and become those to show. `before` are those
  // that were shown with the frame before; empty: there was none.
  void finish(const LearntFrame& frame, std::span<const float> before, std::span<float> coefficients);
  [[nodiscard]] const LearntHair* hair() const { return hair_.get(); }
  // Whether the network has begun too late to be right by now. A frame without coefficients is then too early, which
  // the server cannot know.
  [[nodiscard]] bool is_unsettled() const {
    return has_begun_ && followed_ticks_ < kLearntSettled_ticks - kLearntGapMax_ticks;
  }
  // Whether frames of other levels are shown as they are.
  [[nodiscard]] bool is_idle() const { return !hair_ && surprise_.empty(); }

 private:
  // Null while the network does not run.
  std::shared_ptr<const LearntHair> hair_;
  LearntState state_;
  // The coefficients that the network gave at the last frame.
  std::vector<float> evaluated_;
  // The shown coefficients minus evaluated_; empty means zero.
  std::vector<float> residual_;
  // The shown coefficients minus those of the server's frame; empty means zero.
  std::vector<float> surprise_;
  // has_begun_: the network has seen a pose. is_new_: it has seen its first one at this frame.
  bool has_begun_ = false, is_new_ = false;
  // The last frame had no coefficients.
  bool was_evaluated_ = false;
  // The number of ticks since the network began.
  std::uint64_t followed_ticks_ = 0;
};

}  // namespace hairnet::link
