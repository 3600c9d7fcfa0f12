#pragma once

#include <optional>

#include "client/render/camera.hpp"

namespace hairnet::viewer {

struct Ray {
  Vec3 origin, direction;  // world, m; unit length
};

// How far along the ray a sphere is met first; none when it is not, or lies behind.
std::optional<double> hit_sphere(const Ray& ray, const Vec3& centre, double radius_m);

// A camera that turns about a point, and may follow one. Pixels count from the top left. Knows no window.
class OrbitCamera {
 public:
  static constexpr double kFov_deg = 26;

  // Turns by a drag of so many pixels: half a turn over the height of the window.
  void orbit(double right_px, double down_px, int height_px);
  // Moves so that what lies at the target's distance keeps under the mouse.
  void pan(double right_px, double down_px, int height_px);
  void zoom(double steps);  // of the wheel; positive: nearer
  // Looks at a sphere so that it fills the height; the bearing stays.
  void frame(const Vec3& centre, double radius_m);
  void look_from(const Vec3& direction);  // unit, from the target to the eye

  // From now on the target goes along with `point` as it moves, smoothly; call once a picture. None: it stays.
  void follow(const std::optional<Vec3>& point, double elapsed_s);

  [[nodiscard]] render::Camera camera() const;
  [[nodiscard]] Ray ray(double x_px, double y_px, int width_px, int height_px) const;
  [[nodiscard]] double distance_m() const { return distance_m_; }
  [[nodiscard]] Vec3 right() const;  // world, unit
  [[nodiscard]] Vec3 up() const;
  // Metres that a pixel spans at the target.
  [[nodiscard]] double pixel_m(int height_px) const;
  // How tall a sphere stands on the picture, as a share of its height; 0 behind the eye.
  [[nodiscard]] double height_share(const Vec3& centre, double diameter_m) const;
  [[nodiscard]] bool in_view(const Vec3& centre, double radius_m, double aspect) const;

 private:
  [[nodiscard]] Vec3 backward() const;  // unit, from the target to the eye

  Vec3 target_{0, 1.5, 0};
  double distance_m_ = 2, yaw_ = 0.69, pitch_ = 0.12;  // rad; yaw 0 looks at a face that looks along +Z
  std::optional<Vec3> followed_;                       // the last place of the followed character
};

}  // namespace hairnet::viewer
