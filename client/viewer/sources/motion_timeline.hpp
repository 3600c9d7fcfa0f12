#pragma once

#include <cstdint>

#include "core/pose/motion.hpp"

namespace hairnet::viewer {

// How a clip goes over into its next round where its end does not meet its beginning. `plain`: it jumps, a teleport.
// `smooth`: it stays about its place, what it travels taken out, and is eased into its beginning over kSeam_s.
enum class Loop : std::uint8_t { plain, smooth };

// A motion on the time line of a stream: upright until kLeadIn_s before 0, eased into the clip; the clip from 0, over
// and over until `duration_s` (infinity: forever); then eased upright within kEaseUpright_s and still.
class MotionTimeline {
 public:
  static constexpr double kLeadIn_s = 0.5;
  static constexpr double kEaseUpright_s = 1;
  static constexpr double kSeam_s = 0.8;

  // `motion` must outlive this.
  MotionTimeline(const Motion& motion, double duration_s, Loop loop = Loop::plain);
  [[nodiscard]] Pose at(double time_s) const;
  // Whether the pose jumps in (from_s, to_s]: a teleport of the clip, or its end not meeting its beginning.
  [[nodiscard]] bool teleports(double from_s, double to_s) const;

 private:
  [[nodiscard]] Pose clip(double time_s) const;

  const Motion& motion_;
  double duration_s_, period_s_;
  bool loops_smoothly_;
  bool eases_seam_ = false;
  Vec3 drift_m_per_s_ = Vec3::Zero();  // taken out, on the floor
};

}  // namespace hairnet::viewer
