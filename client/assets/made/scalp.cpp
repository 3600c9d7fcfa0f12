#include "client/assets/made/scalp.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/easing.hpp"
#include "core/random.hpp"

namespace hairnet::made {
namespace {

// The hairline: its height over the azimuth in degrees, from the forehead past the temple, the ear and down the nape.
// Between two marks the line eases, so it has no corners.
struct HairlineMark {
  double azimuth_deg, height_m;
};
constexpr std::array<HairlineMark, 11> kHairline{{{0, 0.108},
                                                  {22, 0.108},
                                                  {40, 0.099},
                                                  {52, 0.078},
                                                  {66, 0.042},
                                                  {74, 0.024},
                                                  {82, 0.066},
                                                  {100, 0.068},
                                                  {114, 0.020},
                                                  {135, -0.014},
                                                  {180, -0.028}}};

// Both sides are alike.
double hairline_height(double azimuth) {
  const double degrees = std::abs(azimuth) * 180 / std::numbers::pi;
  std::size_t i = 1;
  while (i + 1 < kHairline.size() && kHairline[i].azimuth_deg < degrees) {
    ++i;
  }
  const HairlineMark &a = kHairline[i - 1], &b = kHairline[i];
  return mix(a.height_m, b.height_m, smootherstep(a.azimuth_deg, b.azimuth_deg, degrees));
}

double azimuth_of(const Vec3& p) {
  return std::atan2(p.x() - kSkullCentre.x(), p.z() - kSkullCentre.z());
}

}  // namespace

// It is a difference of heights, not a distance along the skin.
double above_hairline(const Vec3& p) {
  return p.y() - hairline_height(azimuth_of(p));
}

std::vector<Root> scatter_roots(std::size_t count, std::uint64_t seed, const std::function<bool(const Vec3&)>& keep) {
  // Kronecker sequence of the plastic number in two dimensions. Chance decides whether to keep a root: a third
  // dimension of the sequence would pick rows.
  constexpr std::array<double, 2> kStep{0.7548776662466927, 0.5698402909980532};
  Random random(seed, 11);
  // Each seed begins the sequence at another place.
  std::array<double, 2> u{random.unit(), random.unit()};
  std::vector<Root> roots;
  roots.reserve(count);
  // A region without scalp must not hang the search.
  for (std::size_t tried = 0; roots.size() < count && tried < 400 * count + 10'000; ++tried) {
    for (std::size_t a = 0; a < 2; ++a) {
      u[a] += kStep[a] - (u[a] + kStep[a] >= 1 ? 1 : 0);
    }
    // Directions below -0.85 are the neck and are left out. A uniform height with a uniform azimuth is even on a
    // sphere.
    const double y = mix(-0.85, 1, u[0]), azimuth = 2 * std::numbers::pi * u[1];
    const double r = std::sqrt(1 - y * y);
    Vec3 direction(r * std::sin(azimuth), y, r * std::cos(azimuth));
    // Moves roots by about half of the distance between neighbours, because the sequence alone shows as rows.
    const double stray = 1.3 / std::sqrt(static_cast<double>(count));
    direction += stray * Vec3(random.symmetric(), random.symmetric(), random.symmetric());
    direction.normalize();
    const Vec3 p = skin_along(direction);
    // The random border keeps the hairline from looking drawn.
    if (above_hairline(p) < 0.004 * random.symmetric() || (keep && !keep(p))) {
      continue;
    }
    const Vec3 normal = bust_normal(p);
    // An even spread over directions is not even over skin: area grows with distance squared over the cosine. So chance
    // drops roots in directions whose skin has less area. Directions with 0.0125 m^2 and more keep all their roots.
    const double area = (p - kSkullCentre).squaredNorm() / std::max(0.3, normal.dot(direction));
    if (random.unit() * 0.0125 > area) {
      continue;
    }
    // The height is 0 at the nape, 3 cm below the origin, and 1 at the crown.
    const double height = std::clamp((p.y() + 0.03) / 0.18, 0.0, 1.0);
    roots.push_back({p, normal, azimuth_of(p), height});
  }
  return roots;
}

}  // namespace hairnet::made
