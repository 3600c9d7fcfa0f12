#include "client/viewer/drawing/mouse_hand.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "client/draw/hair_motion.hpp"
#include "client/viewer/drawing/framing.hpp"
#include "core/modes/moved_lattice.hpp"
#include "core/skin/skin_distance_field.hpp"
#include "core/world/grab.hpp"

namespace hairnet::viewer {
namespace {

// The mouse has one hand with one shape, so all its holds and pins have one name.
constexpr TouchKey kMouse{.toucher = 1, .number = 0};
// Hair is thin, so a press need not meet it exactly. It may miss it by 8 mm, the width of a fingertip, or by 6 pixels
// where that is more.
constexpr double kPickReach_px = 6, kPickReach_m = 0.008;
// The hand that holds hair has this radius: it is so small that the hand pushes no hair aside.
constexpr double kFingertipRadius_m = 0.005;
// At most this many points of a groom are searched: a press must not wait for millions of them.
constexpr std::size_t kPickedPointsMax = 20'000;
// A ball of this radius about the middle of a head contains the body's skin.
constexpr double kBodyRadius_m = 0.6;
// The ray is followed in steps of this length: a part of the body that is thinner may be missed.
constexpr double kSkinStep_m = 0.004;
// Roots lie a little under the skin that a ray meets, and must still be found.
constexpr double kRootDepth_m = 0.01;
constexpr double kNoHit_m = std::numeric_limits<double>::infinity();

Vec3 forward(const OrbitCamera& camera) {
  const draw::Camera at = camera.camera();
  return (at.target - at.eye).normalized();
}

bool is_in_skin(const ViewedCharacter& character, const Vec3& place) {
  return std::ranges::any_of(*character.skin, [&](const SkinDistanceField& field) {
    return skin_distance(field, character.pose[field.bone].inverse().point(place)) < 0;
  });
}

// The distance along the ray to the first skin; infinite when it meets none. It walks in small steps: the skin is known
// as distances on a grid, not as triangles.
double first_skin_m(const Ray& ray, std::span<const ViewedCharacter> viewed) {
  double nearest_m = kNoHit_m;
  for (const ViewedCharacter& character : viewed) {
    if (character.skin == nullptr) continue;
    const std::optional<double> enters = hit_sphere(ray, head_middle(character.pose), kBodyRadius_m);
    if (!enters) continue;
    // Skin behind a nearer one does not matter.
    const double end_m = std::min(*enters + 2 * kBodyRadius_m, nearest_m);
    for (double at_m = *enters; at_m < end_m; at_m += kSkinStep_m) {
      if (!is_in_skin(character, ray.origin + at_m * ray.direction)) continue;
      nearest_m = at_m;
      break;
    }
  }
  return nearest_m;
}

// Hair without a lattice cannot move, and hair of others is not ours to touch.
bool can_be_touched(const ViewedCharacter& character) {
  return character.own && character.groom && character.lattice.geometry != nullptr;
}

}  // namespace

std::optional<PickedHair> pick_hair(const Ray& ray, double reach_per_m, std::span<const ViewedCharacter> viewed) {
  std::optional<PickedHair> picked;
  double nearest_m = kNoHit_m;
  std::vector<Vec3f> scratch;
  for (const ViewedCharacter& character : viewed) {
    if (!can_be_touched(character)) continue;
    const std::span<const Vec3f> nodes = nodes_of(character.lattice, scratch);
    const draw::HairMotion::Nodes moved{character.lattice.geometry->lattice, {nodes.begin(), nodes.end()}};
    const RigidTransform& head = character.pose.head();
    const std::vector<Vec3f>& points = character.groom->points;
    const std::size_t stride = points.size() / kPickedPointsMax + 1;
    for (std::size_t p = 0; p < points.size(); p += stride) {
      // Linear FFD suffices to find hair, which is drawn a little beside at most.
      const Vec3 place = head.point((points[p] + draw::displacement_at(moved, points[p])).cast<double>());
      const Vec3 to = place - ray.origin;
      const double along_m = to.dot(ray.direction);
      // Hair behind the eye, or behind what was found, cannot be what the user sees.
      if (along_m <= 0 || along_m >= nearest_m) continue;
      const double aside_m = (to - along_m * ray.direction).norm();
      // At a distance the reach grows with the size of a pixel.
      if (aside_m > std::max(kPickReach_m, reach_per_m * along_m)) continue;
      nearest_m = along_m;
      picked = {character.id, place};
    }
  }
  if (picked && nearest_m > first_skin_m(ray, viewed) + kRootDepth_m) return {};
  return picked;
}

void MouseHand::press(const MouseInput& mouse, const LocalWorld& world, const OrbitCamera& camera, int width_px,
                      int height_px) {
  // pixel_m() is the size of a pixel at the camera's target; divided by the distance it is that at one metre.
  const double reach_per_m = kPickReach_px * camera.pixel_m(height_px) / camera.distance_m();
  const Ray ray = camera.ray(mouse.x_px, mouse.y_px, width_px, height_px);
  const std::optional<PickedHair> picked = pick_hair(ray, reach_per_m, world.viewed_characters());
  if (!picked) return;
  action_ = mouse.ctrl ? Action::stroke : Action::hold;
  has_touched_ = true;
  id_ = picked->id;
  place_ = picked->place;
  // The depth along the view, not along the ray: the plane of the hand is parallel to the screen.
  depth_m_ = (place_ - ray.origin).dot(forward(camera));
  // The ball comes from outside the hair: one that appeared within it would throw it aside.
  if (action_ == Action::stroke) place_ -= kBallRadius_m * forward(camera);
}

void MouseHand::release(bool pins, LocalWorld& world) {
  // Without a hold there is nothing to let go of, also when the button was released before the first tick.
  if (has_hold_) world.let_go_of_hair(id_, kMouse, pins ? Release::pin : Release::drop);
  action_ = Action::none;
  is_in_world_ = has_hold_ = false;
}

bool MouseHand::apply(const MouseInput& mouse, LocalWorld& world, const OrbitCamera& camera, int width_px,
                      int height_px) {
  const bool was_pressed = std::exchange(is_pressed_, mouse.left || mouse.middle || mouse.right);
  // Release first: a button that went up and down between two pictures begins another drag.
  if (action_ != Action::none && !mouse.left) release(mouse.shift, world);
  const bool is_left_alone = mouse.left && !mouse.middle && !mouse.right;
  if (!was_pressed && is_left_alone && !mouse.elsewhere && !mouse.shift)
    press(mouse, world, camera, width_px, height_px);
  if (action_ == Action::none) return false;
  // A mouse outside the window leaves the hand at its edge, so that it does not fly off.
  const Ray ray = camera.ray(std::clamp(mouse.x_px, 0.0, static_cast<double>(width_px)),
                             std::clamp(mouse.y_px, 0.0, static_cast<double>(height_px)), width_px, height_px);
  // The hand's place is where the ray meets the plane.
  target_ = ray.origin + depth_m_ / ray.direction.dot(forward(camera)) * ray.direction;
  return true;
}

std::vector<TouchBody> MouseHand::tick(double elapsed_s, LocalWorld& world) {
  if (action_ == Action::none) return {};
  // A hand can take hold only once the world has it: the first tick brings the hand, the second takes hold.
  const bool was_in_world = std::exchange(is_in_world_, true);
  if (was_in_world) {
    if (action_ == Action::hold && !has_hold_)
      has_hold_ = world.take_hair(id_, {kMouse, Vec3::Zero(), kHoldRadius_m}) > 0;
    const Vec3 way = target_ - place_;
    // The world's time counts, so in slow motion the hand is as slow as the hair.
    const double step_max_m = kSpeedMax_m_per_s * elapsed_s;
    place_ += std::min(1.0, step_max_m / std::max(way.norm(), step_max_m)) * way;
  }
  const double radius_m = action_ == Action::stroke ? kBallRadius_m : kFingertipRadius_m;
  // A shape that appears has jumped: it must not sweep hair along on its way from nowhere.
  return {{kMouse, sphere(radius_m), {Quat::Identity(), place_}, !was_in_world}};
}

void unpin_hair(LocalWorld& world) {
  // Letting go may change the list of viewed characters.
  std::vector<std::uint64_t> ids;
  for (const ViewedCharacter& character : world.viewed_characters()) ids.push_back(character.id);
  for (const std::uint64_t id : ids) world.let_go_of_hair(id, kMouse, Release::unpin);
}

}  // namespace hairnet::viewer
