#pragma once

#include "core/pose/motion.hpp"

namespace hairnet::viewer {

// A motion on the time line of a stream: upright until kLeadIn_s before 0, eased into the clip; the clip from 0, over
// and over until `duration_s`; then eased upright within kEaseUpright_s and still.
class Performance {
 public:
  static constexpr double kLeadIn_s = 0.5;
  static constexpr double kEaseUpright_s = 1;

  // `motion` must outlive this.
  Performance(const Motion& motion, double duration_s);
  [[nodiscard]] Pose at(double time_s) const;
  // Whether the pose jumps in (from_s, to_s]: a teleport of the clip, or its end not meeting its beginning.
  [[nodiscard]] bool jumps(double from_s, double to_s) const;

 private:
  [[nodiscard]] Pose clip(double time_s) const;

  const Motion& motion_;
  double duration_s_, period_s_;
  bool loops_smoothly_;
};

}  // namespace hairnet::viewer
