#include "core/made/ponytail.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/made/bust_shape.hpp"
#include "core/made/smooth.hpp"

namespace hairnet::made {
namespace {

const Vec3 kBandCentre{0, 0.098, -0.118};
const Vec3 kBandAxis = Vec3(0, 0.42, -0.91).normalized();  // out of the head
const Vec3 kBandUp = Vec3::UnitX().cross(kBandAxis).normalized() * -1.0;
constexpr double kBandRadius = 0.0125;

Vec3 on_band(double angle, double radius) {
  return kBandCentre + radius * (std::sin(angle) * Vec3::UnitX() + std::cos(angle) * kBandUp);
}

// Along the scalp to the band, as a taut thread would lie, each strand to its own place in it.
Path pulled(const Root& root, Random& random) {
  const Vec3 across = root.point - kBandCentre;
  const double angle = std::atan2(across.dot(Vec3::UnitX()), across.dot(kBandUp)) + 0.12 * random.symmetric();
  const Vec3 goal = on_band(angle, kBandRadius * std::sqrt(random.between(0.25, 1.0)));
  const double far = (root.point - goal).norm();
  const double lift = random.between(0.0015, 0.0065) * smooth_step(0.0, 0.1, far) + 0.0015;
  const Vec3 stray = 0.05 * Vec3(random.symmetric(), random.symmetric(), random.symmetric());
  Growth growth;
  growth.start = root.point;
  growth.length_m = 0.6;
  growth.step_m = 0.004;
  growth.bend_m = 0.008;
  growth.spares_face = false;
  growth.wish = [goal, stray](const Here& at) {
    const Vec3 to = goal - at.p;
    return Vec3(to.normalized() + stray * std::exp(-at.s / 0.05));
  };
  growth.direction = 0.35 * root.normal + (goal - root.point).normalized();
  growth.clearance = [lift](const Vec3&, double s) { return std::min(0.5 * s, lift * (1 - std::exp(-s / 0.02))); };
  growth.done = [goal](const Vec3& p, double) { return (goal - p).norm() < 0.005; };
  Path path = grow(growth);
  path.push_back(goal + 0.004 * kBandAxis);
  return path;
}

// Out of the band, over in an arch and down, spreading and then tapering.
Path tail(double length_m, Random& random) {
  const double angle = 2 * std::numbers::pi * random.unit();
  const double ring = std::sqrt(random.unit());
  const Vec3 radial = std::sin(angle) * Vec3::UnitX() + std::cos(angle) * kBandUp;
  const double thin = random.unit();
  const double length = length_m * (1 - 0.32 * thin * thin);
  const Vec3 stray = 0.035 * Vec3(random.symmetric(), random.symmetric(), random.symmetric());
  Growth growth;
  growth.start = on_band(angle, kBandRadius * ring) - 0.004 * kBandAxis;
  growth.direction = kBandAxis + 0.45 * ring * radial;
  growth.length_m = length;
  growth.bend_m = 0.042;
  growth.spares_face = false;
  const double spread = 0.038 * ring;
  growth.wish = [=](const Here& at) {
    const double gathered = smooth_step(0, 0.10, at.s) * (1 - 0.75 * smooth_step(0.4 * length_m, length_m, at.s));
    // Gathers sideways only: forwards and backwards the fall decides.
    const double in = 6 * (spread * radial.x() * gathered - at.p.x());
    return Vec3(Vec3(in, -1, 0) + stray + 0.8 * kBandAxis * std::exp(-at.s / 0.018));
  };
  const double lift = 0.004 + 0.035 * (0.5 + 0.5 * ring * std::cos(angle));
  growth.clearance = [lift](const Vec3&, double s) { return lift * smooth_step(0.0, 0.1, s); };
  return grow(growth);
}

// A turn and a half of hair that hides the band.
Path wrap(Random& random) {
  Path path;
  const double from = 2 * std::numbers::pi * random.unit(), along = random.between(-0.007, 0.007);
  const double radius = kBandRadius + random.between(0.0005, 0.0030) * (1 - std::abs(along) / 0.012);
  for (int i = 0; i <= 40; ++i) {
    const double t = i / 40.0;
    path.push_back(on_band(from + 3 * std::numbers::pi * t, radius) + (along + 0.002 * (t - 0.5)) * kBandAxis);
  }
  return path;
}

}  // namespace

void dress_ponytail(const StyleOptions& options, Groom& groom) {
  const std::size_t wrap_count = options.strand_count / 50;
  const std::size_t tail_count = options.strand_count * 2 / 5;
  const std::size_t pulled_count = options.strand_count - tail_count - wrap_count;
  Random random(options.seed, 31);
  StrandFinish finish;
  finish.hair_count = kHairsInAll / static_cast<double>(options.strand_count);
  finish.points = 18;
  finish.group = group_index(groom, "pulled");
  finish.skin_clearance_m = 0.0015;
  // Nothing before the ears, which it would have to cross.
  const auto keep = [](const Vec3& p) { return p.z() < -0.012 || p.y() > 0.066; };
  for (const Root& root : scatter_roots(pulled_count, options.seed, keep)) {
    add_path(groom, pulled(root, random), finish);
  }

  finish.rooted = false;
  finish.group = group_index(groom, "wrap");
  for (std::size_t i = 0; i < wrap_count; ++i) {
    add_path(groom, wrap(random), finish);
  }

  finish.group = group_index(groom, "tail");
  finish.skin_clearance_m = 0.003;
  finish.points = curl_points(options.curl, options.length_m, 20);
  for (std::size_t i = 0; i < tail_count; ++i) {
    const Path path = tail(options.length_m, random);
    // One lock in all, so its curls run nearly in step.
    Random shared(options.seed, 1000 + random.next() % 24);
    Curl curl = make_curl(options.curl, shared);
    curl.phase += 0.7 * random.symmetric();
    add_path(groom, curled(path, curl), finish);
  }
}

}  // namespace hairnet::made
