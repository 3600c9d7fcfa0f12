#include "client/viewer/drawing/mouse_controller.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "client/viewer/drawing/framing.hpp"

namespace hairnet::viewer {

// Each head is taken as a ball; the nearest one that the ray meets is picked.
std::optional<std::uint64_t> pick(const Ray& ray, std::span<const ViewedCharacter> viewed) {
  std::optional<std::uint64_t> nearest;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const ViewedCharacter& character : viewed) {
    const std::optional<double> at = hit_sphere(ray, head_middle(character.pose), kHeadRadius_m);
    if (!at || *at >= nearest_m) continue;
    nearest_m = *at;
    nearest = character.id;
  }
  return nearest;
}

std::optional<std::uint64_t> MouseController::take_chosen() {
  return std::exchange(chosen_, std::nullopt);
}

void MouseController::begin(const MouseInput& mouse, HairSource& source, const OrbitCamera& camera, int width_px,
                            int height_px) {
  // A drag that began over a panel stays with the panel, wherever the mouse goes.
  if (mouse.elsewhere) {
    drag_ = Drag::elsewhere;
    return;
  }
  if (mouse.middle || mouse.right) {
    drag_ = Drag::pan;
    return;
  }
  drag_ = Drag::orbit;
  // A press chooses the character for the panel, whether or not it can be dragged.
  chosen_ = pick(camera.ray(mouse.x_px, mouse.y_px, width_px, height_px), source.viewed_characters());
  HeadGrab* grab = chosen_ ? source.grab(*chosen_) : nullptr;
  if (grab == nullptr) return;
  drag_ = Drag::head;
  grabbed_ = chosen_;
  // The head's depth makes it follow the mouse exactly when it is moved.
  depth_m_ = camera.distance_m();
  for (const ViewedCharacter& character : source.viewed_characters()) {
    if (character.id == *grabbed_) depth_m_ = (camera.camera().eye - head_middle(character.pose)).norm();
  }
  grab->take();
}

void MouseController::release(HairSource& source) {
  drag_ = Drag::none;
  if (HeadGrab* grab = grabbed_ ? source.grab(*grabbed_) : nullptr; grab != nullptr) grab->release();
  grabbed_.reset();
}

void MouseController::apply(const MouseInput& mouse, HairSource& source, OrbitCamera& camera, int width_px,
                            int height_px) {
  if (!mouse.elsewhere && mouse.wheel != 0) camera.zoom(mouse.wheel);
  const bool pressed = mouse.left || mouse.middle || mouse.right;
  if (!pressed) {
    if (drag_ != Drag::none) release(source);
    return;
  }
  if (drag_ == Drag::none) begin(mouse, source, camera, width_px, height_px);
  // A press without a motion changes nothing more.
  if (mouse.right_px == 0 && mouse.down_px == 0) return;
  if (drag_ == Drag::orbit) camera.orbit(mouse.right_px, mouse.down_px, height_px);
  if (drag_ == Drag::pan) camera.pan(mouse.right_px, mouse.down_px, height_px);
  if (drag_ != Drag::head) return;
  HeadGrab* grab = source.grab(*grabbed_);
  // The character may have gone during the drag.
  if (grab == nullptr) return release(source);
  if (mouse.shift) {
    // A pixel spans more metres at a head that is further away than the target.
    const double pixel_m = camera.pixel_m(height_px) * depth_m_ / camera.distance_m();
    grab->move(pixel_m * (mouse.right_px * camera.right() - mouse.down_px * camera.up()));
  } else {
    // A drag over the height of the window turns a head by three quarters of a circle.
    const double per_px = 1.5 * std::numbers::pi / height_px;
    grab->turn(camera.up(), per_px * mouse.right_px);
    grab->turn(camera.right(), per_px * mouse.down_px);
  }
}

}  // namespace hairnet::viewer
