#pragma once

#include <deque>

#include "client/link/playout.hpp"
#include "client/tools/view/moment.hpp"

namespace hairnet::viewer {

// Keeps what a character's hair was like just before and after its last switches of level, so that a moment can be
// blended as a display would have done it (link::SwitchBlend), though it is deformed only later. One thread.
class SwitchTrail {
 public:
  // All that is played, in order.
  void note(const link::Playout::Sample& sample);
  // Of the sample noted last.
  [[nodiscard]] Moment moment(const Pose& pose) const;

 private:
  bool started_ = false;
  Shape last_;
  std::deque<Shape> around_;  // before, after, before, after, ...
};

}  // namespace hairnet::viewer
