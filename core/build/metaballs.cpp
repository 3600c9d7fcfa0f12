#include "core/build/metaballs.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet {
namespace {

constexpr double kLoad = 5 * 9.81;                                 // m/s^2 on the node's mass
constexpr double kDent = 0.005;                                    // m that the load may press in
constexpr double kRadiusRatioLeast = 0.7, kRadiusRatioMost = 1.4;  // of the ball's typical radius
constexpr double kRadiusRatioOff = 1.0 / 3;
// The force rises inwards to rho / sqrt(5) only: a dent must end well before.
constexpr double kRadiusLeast = 3 * kDent;  // m

// From the centre to the skin in a direction: the outermost skin that the ball may reach, since a head has inner shells
// (mouth, eyes). Looked for from outside.
double skin_distance(const MeshQuery& skin, const BodyBall& ball, const Vec3& direction) {
  const double most = kRadiusRatioMost * ball.radius;
  const auto hit = skin.first_hit(ball.centre + most * direction, -direction, most);
  const double distance = hit ? most - hit->distance : most;
  return std::max(distance, kRadiusRatioLeast * ball.radius);
}

double fitted_radius(const MeshQuery& skin, const BodyBall& ball, const Vec3& node, bool is_inside,
                     double thickness_m) {
  const Vec3 from_centre = node - ball.centre;
  const double distance = from_centre.norm();
  const double off_below = std::max(kRadiusRatioOff * ball.radius, kRadiusLeast);
  if (distance < off_below) return 0;
  const double to_skin = skin_distance(skin, ball, from_centre / distance);
  // A little less than the distance, so that u >= 1 in float as well.
  const double radius = std::min(to_skin + (is_inside ? 0 : thickness_m), distance * (1 - 1e-6));
  return radius < off_below ? 0 : radius;
}

// U for which f = (6U / rho^2) (1 - u)^2 r carries the load at r = rho - kDent.
double potential_for_load(double radius, double load_n) {
  const double r = radius - kDent, u = r * r / (radius * radius);
  return load_n * radius * radius / (6 * (1 - u) * (1 - u) * r);
}

}  // namespace

std::vector<Metaball> fit_metaballs(const BodyShape& shape, std::span<const Vec3f> rest_head,
                                    std::span<const double> mass, const Material& material) {
  std::vector<bool> is_inside;
  for (const Vec3f& node : rest_head) is_inside.push_back(shape.skin.inside(node.cast<double>()));

  std::vector<Metaball> metaballs;
  for (const BodyBall& ball : shape.balls) {
    Metaball metaball{ball.bone, ball.centre.cast<float>(), {}, {}};
    const BodyBall stored{ball.bone, metaball.centre.cast<double>(), ball.radius};
    for (std::size_t i = 0; i < rest_head.size(); ++i) {
      const double radius = fitted_radius(shape.skin, stored, rest_head[i].cast<double>(), is_inside[i],
                                          static_cast<double>(material.thickness_m));
      const double least = static_cast<double>(material.metaball_potential_j);
      metaball.radius.push_back(static_cast<float>(radius));
      metaball.potential.push_back(
          radius > 0 ? static_cast<float>(std::max(least, potential_for_load(radius, kLoad * mass[i]))) : 0.0f);
    }
    metaballs.push_back(std::move(metaball));
  }
  return metaballs;
}

}  // namespace hairnet
