#pragma once

#include <cstdint>
#include <optional>

#include "client/viewer/drawing/orbit_camera.hpp"
#include "client/viewer/sources/hair_source.hpp"

namespace hairnet::viewer {

// The mouse input since the last picture. Pixels count from the top left of the picture, in its own pixels, not in the
// points of a dense display.
struct MouseInput {
  // Where the mouse is now.
  double x_px = 0, y_px = 0;
  // The way that it has moved, and the steps that its wheel has turned; steps above 0 bring the camera nearer.
  double right_px = 0, down_px = 0, wheel = 0;
  // These buttons are pressed now.
  bool left = false, middle = false, right = false;
  bool shift = false, ctrl = false;
  // The mouse is over controls, which get the input.
  bool elsewhere = false;
};

// Turns mouse input into actions. The left button turns an own head when pressed on it (with shift it moves the head),
// and orbits the camera when pressed elsewhere. The middle and right buttons pan the camera, the wheel zooms. What a
// drag does is decided by its press: keys that come later change only between turning and moving. Knows no window; one
// thread.
class MouseController {
 public:
  // Call it once for each picture, with all input since the last one.
  void apply(const MouseInput& mouse, HairSource& source, OrbitCamera& camera, int width_px, int height_px);
  // The character whose head is being dragged.
  [[nodiscard]] std::optional<std::uint64_t> grabbed() const { return grabbed_; }
  // Returns the character whose head was pressed last, own or not, and forgets it.
  std::optional<std::uint64_t> take_chosen();

 private:
  enum class Drag : std::uint8_t { none, head, orbit, pan, elsewhere };
  void begin(const MouseInput& mouse, HairSource& source, const OrbitCamera& camera, int width_px, int height_px);
  void release(HairSource& source);

  Drag drag_ = Drag::none;
  // The depth of the head that is dragged, m from the eye.
  double depth_m_ = 1;
  std::optional<std::uint64_t> grabbed_, chosen_;
};

// A ball of this radius about head_middle() stands for a head when it is picked: the body's mesh alone would not have
// the hair around it.
inline constexpr double kHeadRadius_m = 0.15;

// The character whose head the ray hits first.
std::optional<std::uint64_t> pick(const Ray& ray, std::span<const ViewedCharacter> viewed);

}  // namespace hairnet::viewer
