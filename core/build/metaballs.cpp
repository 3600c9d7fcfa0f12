#include "core/build/metaballs.hpp"

#include "core/build/skin_profile.hpp"
#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace hairnet {
namespace {

constexpr double kLoad = 5 * 9.81;                                 // m/s^2 on the node's mass
constexpr double kDent = 0.005;                                    // m that the load may press in
constexpr double kRadiusRatioOff = 1.0 / 3;
// The force rises inwards to rho / sqrt(5) only: a dent must end well before.
constexpr double kRadiusLeast = 3 * kDent;  // m

double env(const char* n, double d) { const char* v = std::getenv(n); return v ? std::atof(v) : d; }

// How far the node may go in towards the centre.
double own_travel(const SkinProfile& skin, const BodyBall& ball, const Vec3& node, bool is_inside, double thickness_m) {
  const Vec3 from_centre = node - ball.centre;
  const double distance = from_centre.norm();
  if (is_inside || distance < 1e-6) return 0;
  return std::max(0.0, distance - skin.distance(from_centre) - thickness_m);
}

double radius_of(const BodyBall& ball, double distance, double travel) {
  const double off_below = std::max(kRadiusRatioOff * ball.radius, kRadiusLeast);
  // A little less than the distance, so that u >= 1 in float as well.
  const double radius = std::min(distance - travel, distance * (1 - 1e-6));
  return radius < off_below ? 0 : radius;
}

// U for which f = (6U / rho^2) (1 - u)^2 r carries the load at r = rho - kDent.
double potential_for_load(double radius, double load_n) {
  const double r = radius - kDent, u = r * r / (radius * radius);
  return load_n * radius * radius / (6 * (1 - u) * (1 - u) * r);
}

}  // namespace

std::vector<Metaball> fit_metaballs(const BodyShape& shape, std::span<const Vec3f> rest_head,
                                    std::span<const double> mass, const Material& material,
                                    const HairStencils& stencils) {
  std::vector<bool> is_inside;
  for (const Vec3f& node : rest_head) is_inside.push_back(shape.skin.inside(node.cast<double>()));

  std::vector<Metaball> metaballs;
  for (const BodyBall& ball : shape.balls) {
    Metaball metaball{ball.bone, ball.centre.cast<float>(), {}, {}};
    const BodyBall stored{ball.bone, metaball.centre.cast<double>(), ball.radius};
    const SkinProfile profile(shape.skin, stored);
    std::vector<double> travel;
    for (std::size_t i = 0; i < rest_head.size(); ++i) {
      travel.push_back(own_travel(profile, stored, rest_head[i].cast<double>(), is_inside[i],
                                          static_cast<double>(material.thickness_m) + env("HN_K", 0) * stencils.spacing_m));
    }
    std::vector<double> clearance;
    for (std::size_t p = 0; p + 1 < stencils.begin.size(); ++p) {
      const Vec3 r = shape.hair.points[p].cast<double>() - stored.centre;
      clearance.push_back(std::max(0.0, r.norm() - profile.distance(r)) + env("HN_TOL", 0));
    }
    if (env("HN_CLEAR", 1) > 0) limit_travel(stencils, clearance, travel);
    for (std::size_t i = 0; i < rest_head.size(); ++i) {
      const double radius = radius_of(stored, (rest_head[i].cast<double>() - stored.centre).norm(), travel[i]);
      const double least = static_cast<double>(material.metaball_potential_j);
      metaball.radius.push_back(static_cast<float>(radius));
      metaball.potential.push_back(
          radius > 0 ? static_cast<float>(std::max(least * env("HN_U", 1), potential_for_load(radius, env("HN_LOAD", 1) * kLoad * mass[i]))) : 0.0f);
    }
    metaballs.push_back(std::move(metaball));
  }
  return metaballs;
}

}  // namespace hairnet
