#pragma once

#include <cstdint>

#include "core/pose/motion.hpp"

namespace hairnet::viewer {

// The transition from a clip's end to its next round when they do not meet. `plain`: the pose jumps, a teleport, as in
// a picture or trace of the clip itself. `smooth`: the motion stays at its place, without the distance that it travels,
// and its end eases into its beginning over kSeam_s, as in a window that runs on.
enum class Loop : std::uint8_t { plain, smooth };

// A motion on the time line of a stream: upright until kLeadIn_s before 0, then eased into the clip. The clip runs from
// 0, repeatedly until `duration_s` (infinity: forever). Then the pose eases upright within kEaseUpright_s and is still.
// It is a function of time alone, so a live room and a local world move heads alike.
class MotionTimeline {
 public:
  static constexpr double kLeadIn_s = 0.5;
  static constexpr double kEaseUpright_s = 1;
  // The end of a smooth loop eases into its beginning over this time.
  static constexpr double kSeam_s = 0.8;

  // `motion` must have a pose, and must outlive this.
  MotionTimeline(const Motion& motion, double duration_s, Loop loop = Loop::plain);
  // The pose at a time of the stream, world, s; any number is possible.
  [[nodiscard]] Pose at(double time_s) const;
  // Whether the pose jumps in (from_s, to_s]: a teleport of the clip, or an end that does not meet its beginning.
  [[nodiscard]] bool teleports(double from_s, double to_s) const;

 private:
  [[nodiscard]] Pose clip(double time_s) const;

  const Motion& motion_;
  // The clip repeats every period_s_ until duration_s_.
  double duration_s_, period_s_;
  // The end of a round meets the beginning of the next one, by itself or because the seam is eased.
  bool loops_smoothly_;
  bool eases_seam_ = false;
  // The mean velocity on the floor, which is taken off a clip whose seam is eased.
  Vec3 drift_m_per_s_ = Vec3::Zero();
};

}  // namespace hairnet::viewer
