#pragma once

#include <deque>

#include "client/link/playout.hpp"
#include "client/viewer/sources/moment.hpp"

namespace hairnet::viewer {

// Stores the lattices just before and after the last level switches of a character, so that a picture that is drawn
// later can show the same cross-fade as a window (link::SwitchBlend). One thread.
class SwitchHistory {
 public:
  // Takes all played samples, in order.
  void note(const link::Playout::Sample& sample);
  // The moment of the last sample.
  [[nodiscard]] Moment moment(const Pose& pose) const;

 private:
  bool started_ = false;
  Shape last_;
  std::deque<Shape> around_;  // before, after, before, after, ...
};

}  // namespace hairnet::viewer
