#include "client/assets/made/style.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/easing.hpp"

namespace hairnet::made {
namespace {

// The square root makes small amounts differ more than large ones.
double wavelength(double amount) {
  return mix(0.13, 0.032, std::sqrt(amount));
}

}  // namespace

std::uint16_t group_index(Groom& groom, std::string_view name) {
  const auto found = std::find(groom.group_names.begin(), groom.group_names.end(), name);
  const auto index = found - groom.group_names.begin();
  if (found == groom.group_names.end()) {
    groom.group_names.emplace_back(name);
  }
  return static_cast<std::uint16_t>(index);
}

void add_path(Groom& groom, const Path& path, const StrandFinish& finish) {
  const ArcSampler sampler(path);
  std::vector<Vec3f> points(static_cast<std::size_t>(finish.points));
  const double step = sampler.length() / (finish.points - 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = sampler.at(static_cast<double>(i) * step);
    // The second point of a short strand still rises from the skin.
    const double clearance = i == 0 ? 0 : std::min(finish.skin_clearance_m, 0.3 * static_cast<double>(i) * step);
    points[i] = (i == 0 && finish.rooted ? p : push_out(p, clearance)).cast<float>();
  }
  StrandProperties properties;
  properties.group = finish.group;
  properties.hair_count = static_cast<float>(finish.hair_count);
  properties.rooted = finish.rooted;
  // Strands in mid-air have no root on the skull to blend with (paper eq. 7).
  properties.root_length_m = finish.rooted ? 0.02f : 0.0f;
  groom.add_strand(points, properties);
}

// The radius grows up to an amount of 0.45, where the wavelength is still long: so medium amounts make wide curls.
// Chance varies wavelength and radius by up to a quarter.
Curl make_curl(double amount, Random& random) {
  Curl curl;
  curl.wavelength_m = wavelength(amount) * random.between(0.85, 1.2);
  curl.radius_m = 0.0120 * smootherstep(0, 0.45, amount) * mix(1, 0.75, amount) * random.between(0.75, 1.2);
  curl.onset_m = mix(0.16, 0.06, amount);
  curl.phase = 2 * std::numbers::pi * random.unit();
  curl.hand = random.unit() < 0.5 ? -1 : 1;
  curl.flatness = 0.6 * (1 - amount);
  return curl;
}

// Five points a turn show a curl as round; more than 56 points a strand cost more than they show.
int curl_points(double amount, double length_m, int point_count_min) {
  if (amount <= 0) {
    return point_count_min;
  }
  const double turns = length_m / wavelength(amount);
  return std::clamp(static_cast<int>(std::lround(5 * turns)), point_count_min, 56);
}

}  // namespace hairnet::made
