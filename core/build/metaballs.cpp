#include "core/build/metaballs.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet {
namespace {

constexpr double kLoad = 5 * 9.81;  // m/s^2 on the node's mass
constexpr double kDent = 0.005;     // m that the load may press in
constexpr double kRadiusRatioOff = 1.0 / 3;
// The force rises inwards to rho / sqrt(5) only: a dent must end well before.
constexpr double kRadiusLeast = 3 * kDent;  // m

// How far a node outside may come in if it is hair itself.
double own_travel(const BodyBall& ball, const Vec3& from_centre, double thickness_m) {
  const double distance = from_centre.norm();
  if (distance == 0) return 0;
  return std::max(0.0, distance - ball.profile.distance(from_centre) - thickness_m);
}

double radius_after(const BodyBall& ball, double distance, double travel) {
  // A little less than the distance, so that u >= 1 in float as well.
  const double radius = std::min(distance - travel, distance * (1 - 1e-6));
  return radius < std::max(kRadiusRatioOff * ball.radius, kRadiusLeast) ? 0 : radius;
}

// How far each point of the hair is off the skin that the ball stands for.
std::vector<double> clearances(const BodyBall& ball, const HairSample& hair) {
  std::vector<double> clearance_m;
  for (const Vec3f& point : hair.points) {
    const Vec3 r = point.cast<double>() - ball.centre;
    const double distance = r.norm();
    clearance_m.push_back(distance > 0 ? std::max(0.0, distance - ball.profile.distance(r)) : 0);
  }
  return clearance_m;
}

// U for which f = (6U / rho^2) (1 - u)^2 r carries the load at r = rho - kDent.
double potential_for_load(double radius, double load_n) {
  const double r = radius - kDent, u = r * r / (radius * radius);
  return load_n * radius * radius / (6 * (1 - u) * (1 - u) * r);
}

}  // namespace

std::vector<Metaball> fit_metaballs(const BodyShape& shape, const HairStencils& stencils,
                                    std::span<const Vec3f> rest_head, std::span<const double> mass,
                                    const Material& material, const ParallelFor& parallel_for) {
  std::vector<bool> is_inside;
  for (const Vec3f& node : rest_head) is_inside.push_back(shape.skin.inside(node.cast<double>()));

  std::vector<Metaball> metaballs(shape.balls.size());
  run(parallel_for, metaballs.size(), [&](std::size_t b) {
    const BodyBall& ball = shape.balls[b];
    std::vector<double> distance, travel;
    for (std::size_t i = 0; i < rest_head.size(); ++i) {
      const Vec3 from_centre = rest_head[i].cast<double>() - ball.centre;
      distance.push_back(from_centre.norm());
      travel.push_back(is_inside[i] ? 0 : own_travel(ball, from_centre, static_cast<double>(material.thickness_m)));
    }
    limit_travel(stencils, clearances(ball, shape.hair), travel);

    Metaball& metaball = metaballs[b];
    metaball.bone = ball.bone;
    metaball.centre = ball.centre.cast<float>();
    for (std::size_t i = 0; i < rest_head.size(); ++i) {
      const double radius = radius_after(ball, distance[i], travel[i]);
      const double least = static_cast<double>(material.metaball_potential_j);
      metaball.radius.push_back(static_cast<float>(radius));
      metaball.potential.push_back(
          radius > 0 ? static_cast<float>(std::max(least, potential_for_load(radius, kLoad * mass[i]))) : 0.0f);
    }
  });
  return metaballs;
}

}  // namespace hairnet
