#pragma once

#include <optional>

#include "client/draw/camera.hpp"

namespace hairnet::viewer {

// A line of sight; the direction has unit length.
struct Ray {
  // World, m.
  Vec3 origin, direction;
};

// The distance along the ray to the first hit of a sphere; none when the ray misses it, or when it is behind.
std::optional<double> hit_sphere(const Ray& ray, const Vec3& centre, double radius_m);

// A camera that orbits a point, and may follow it. Its up is the world's, so the horizon stays level. Pixels count from
// the top left. Knows no window.
class OrbitCamera {
 public:
  // The vertical field of view: narrow, as portraits are taken.
  static constexpr double kFov_deg = 26;

  // Orbits by a drag of that many pixels: half a turn for the height of the window.
  void orbit(double right_px, double down_px, int height_px);
  // Moves so that a point at the target's distance stays under the mouse.
  void pan(double right_px, double down_px, int height_px);
  // Takes steps of the wheel; positive steps move nearer.
  void zoom(double steps);
  // Looks at a sphere so that it fills the height; the direction does not change. Ends what follow() followed.
  void frame(const Vec3& centre, double radius_m);
  // Takes the unit direction that leads from the target to the eye.
  void look_from(const Vec3& direction);

  // From now on the target smoothly moves with `point`; call it once a picture. None: the target stays. The camera
  // keeps its own offset from the point, so the user's view is kept.
  void follow(const std::optional<Vec3>& point, double elapsed_s);

  [[nodiscard]] draw::Camera camera() const;
  [[nodiscard]] Ray ray(double x_px, double y_px, int width_px, int height_px) const;
  [[nodiscard]] double distance_m() const { return distance_m_; }
  [[nodiscard]] Vec3 right() const;  // world, unit
  [[nodiscard]] Vec3 up() const;
  // Metres that a pixel spans at the target's distance.
  [[nodiscard]] double pixel_m(int height_px) const;
  // The height of a sphere on the picture, as a share of the picture's height; 0 behind the eye.
  [[nodiscard]] double height_share(const Vec3& centre, double diameter_m) const;
  [[nodiscard]] bool in_view(const Vec3& centre, double radius_m, double aspect) const;

 private:
  // The unit direction from the target to the eye.
  [[nodiscard]] Vec3 backward() const;

  Vec3 target_{0, 1.5, 0};
  // Angles are in radians; with a yaw of 0 the eye is on the +Z side, and sees a face that looks along +Z. The first
  // view is the one of View::three_quarter (direction_of), 2 m from a point at about the height of a head.
  double distance_m_ = 2, yaw_ = 0.69, pitch_ = 0.12;
  // The smoothed place of the followed point; none: nothing is followed.
  std::optional<Vec3> followed_;
};

}  // namespace hairnet::viewer
