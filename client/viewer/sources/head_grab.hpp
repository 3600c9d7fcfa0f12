#pragma once

#include "core/groom/body.hpp"
#include "core/pose/pose.hpp"

namespace hairnet::viewer {

// The offset that a mouse drag adds to a head's motion. The head follows the mouse within a few hundredths of a second,
// but never so fast that the move would count as a teleport (is_teleport). After release it returns smoothly, without
// overshoot, while the motion goes on below. Time is a parameter; one thread.
class HeadGrab {
 public:
  // The largest offsets, which keep a head on its neck and in view.
  static constexpr double kTurnMax_rad = 1.9, kShiftMax_m = 1.5;
  // Both speeds stay below the limits of is_teleport (core/pose/pose.hpp), with room for the motion's own speed.
  static constexpr double kTurnSpeedMax_rad_per_s = 25, kShiftSpeedMax_m_per_s = 12;

  // Begins a drag, at the offset that is there.
  void take();
  // Adds a turn about a unit axis of the world to the turn so far; does nothing unless the head is grabbed.
  void turn(const Vec3& axis_world, double angle_rad);
  // Adds to the offset, m.
  void move(const Vec3& by_world_m);
  // Ends the drag: the head returns to its motion.
  void release();
  // Call it once for each picture. A time that is not positive changes nothing.
  void advance(double elapsed_s);

  [[nodiscard]] bool grabbed() const { return grabbed_; }
  // Whether the offset is zero and constant.
  [[nodiscard]] bool at_rest() const;
  // Turns the head about the foot of the neck, and the neck by its share (PoseCompletion); then moves all bones.
  [[nodiscard]] Pose apply(const Pose& pose, const Body& body) const;

 private:
  // A value that moves towards a target with critical damping: as fast as possible without overshoot.
  struct DampedValue {
    Vec3 at = Vec3::Zero(), speed = Vec3::Zero(), target = Vec3::Zero();
    void advance(double elapsed_s, double rate_per_s, double speed_max);
  };
  bool grabbed_ = false;
  // The turn of the head, as a rotation vector, world, rad.
  DampedValue turn_;
  // The offset of the whole body, world, m.
  DampedValue shift_;
};

}  // namespace hairnet::viewer
