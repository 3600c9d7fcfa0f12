#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "client/viewer/drawing/mouse_controller.hpp"
#include "client/viewer/drawing/orbit_camera.hpp"
#include "client/viewer/sources/hair_source.hpp"
#include "client/viewer/sources/local_world.hpp"
#include "core/touch/touch_body.hpp"

namespace hairnet::viewer {

// Hair under the mouse.
struct PickedHair {
  // The id of the character (ViewedCharacter::id).
  std::uint64_t id = 0;
  // The place of the hair, world, m.
  Vec3 place = Vec3::Zero();
};

// Finds the hair that is nearest to the ray's origin, and close to the ray: within 8 mm, or `reach_per_m` times its
// distance if that is more. None where a body hides the hair. Only hair on a lattice can be touched, and found; of a
// large groom only an even part of the points is searched.
std::optional<PickedHair> pick_hair(const Ray& ray, double reach_per_m, std::span<const ViewedCharacter> viewed);

// The mouse as a hand in a local world. A press of the left button on hair takes hold of it; with ctrl, the mouse
// becomes a ball that strokes the hair. The hand then moves in the plane through the pressed hair that is parallel to
// the screen. A release lets the hair go; with shift, it pins the hair to the head. A press with shift is left to
// MouseController, which moves the head. It knows no window; one thread.
class MouseHand {
 public:
  enum class Action : std::uint8_t { none, hold, stroke };
  static constexpr double kBallRadius_m = 0.04;
  // A hold takes the contact points of hair within this radius, which are several at most levels: with a smaller radius
  // a hold would often be empty.
  static constexpr double kHoldRadius_m = 0.04;
  // The hand follows a faster mouse at this speed of the world, m/s: hair that is held is not torn away.
  static constexpr double kSpeedMax_m_per_s = 3;

  // Returns whether the hand has the mouse: nothing else may act on the input then.
  bool apply(const MouseInput& mouse, LocalWorld& world, const OrbitCamera& camera, int width_px, int height_px);
  // Moves the hand for a tick of that length, s, and takes hold of hair; for LocalWorld::touch_by. Returns the hand's
  // shape, or nothing without a drag.
  std::vector<TouchBody> tick(double elapsed_s, LocalWorld& world);

  [[nodiscard]] Action action() const { return action_; }
  // It has taken hold of hair in this drag.
  [[nodiscard]] bool has_hold() const { return has_hold_; }
  // Returns where it was after the last tick of the drag, world, m.
  [[nodiscard]] const Vec3& place() const { return place_; }
  // Some hair was pressed already: the window then needs no hint any more.
  [[nodiscard]] bool has_touched() const { return has_touched_; }

 private:
  void press(const MouseInput& mouse, const LocalWorld& world, const OrbitCamera& camera, int width_px, int height_px);
  void release(bool pins, LocalWorld& world);

  Action action_ = Action::none;
  // A button was down at the last call.
  bool is_pressed_ = false;
  // The world had the hand's shape in its last tick, so the hand can take hold of hair.
  bool is_in_world_ = false;
  // has_hold_: the hand has taken hold of hair in this drag. has_touched_: some hair was pressed since the start.
  bool has_hold_ = false, has_touched_ = false;
  // The id of the character whose hair was pressed.
  std::uint64_t id_ = 0;
  // The distance of the hand's plane from the eye, along the view, m.
  double depth_m_ = 1;
  // place_ is where the hand is after the last tick, target_ where the mouse wants it; world, m.
  Vec3 place_ = Vec3::Zero(), target_ = Vec3::Zero();
};

// Lets all hair go that the mouse has pinned, of all characters.
void unpin_hair(LocalWorld& world);

}  // namespace hairnet::viewer
