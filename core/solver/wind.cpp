#include "core/solver/wind.hpp"

#include <cmath>
#include <numbers>

#include "core/assert.hpp"
#include "core/number_range.hpp"
#include "core/random.hpp"

namespace hairnet {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
// The fastest mean wind, about that of a hurricane.
constexpr double kSpeedMax_m_per_s = 60;
// A component of the wind may be smaller than NumberRange::kSmallest, which other numbers may not: sines and cosines
// leave such a component where a wind blows across an axis. Only a component smaller than this is refused.
constexpr double kComponentMin_m_per_s = 1e-30;
constexpr double kTurbulenceMax_m_per_s = 20;
constexpr double kTurbulenceScaleMax_m = 100;
constexpr double kGustPeriodMin_s = 0.2, kGustPeriodMax_s = 120;

// Wave vectors come in sets of six: two polarisations on each of three perpendicular axes, so that each component of
// the velocity gets the same share.
constexpr int kEddySets = 4;
constexpr std::size_t kEddiesPerSet = 6;
constexpr double kWindAxisTolerance = 1e-9;
// A position in the box may lie outside by this much, by rounding.
[[maybe_unused]] constexpr float kFractionRounding = 1e-5f;

// Sine by its series, |turns| <= 1/4: within 1e-13, and the same bits from every compiler and library.
double sine_of_quarter(double turns) {
  constexpr std::array<double, 10> kSeries = [] {
    std::array<double, 10> series{1};  // 1, -1/3!, 1/5!, ...
    for (std::size_t n = 1; n < series.size(); ++n) {
      series[n] = -series[n - 1] / (2 * static_cast<double>(n) * (2 * static_cast<double>(n) + 1));
    }
    return series;
  }();
  HAIRNET_VALIDATE(std::abs(turns) <= 0.25);
  const double x = kTurn * turns, xx = x * x;
  double sum = 0;
  for (std::size_t n = kSeries.size(); n-- > 0;) sum = kSeries[n] + xx * sum;
  return x * sum;
}

// cos(2 pi turns)
double cosine(double turns) {
  // The cosine is even and has the period 1 in turns, so this part in [0, 1/2] is enough.
  const double part = std::abs(turns - std::floor(turns + 0.5));
  return sine_of_quarter(0.25 - part);
}

double sine(double turns) {
  return cosine(turns - 0.25);
}

// A random unit vector. Points near the centre of the ball are rejected, as their direction is imprecise.
Vec3 random_direction(Random& random) {
  while (true) {
    // braces: evaluated in this order by every compiler
    const Vec3 v{random.symmetric(), random.symmetric(), random.symmetric()};
    const double square = v.squaredNorm();
    if (square > 0.01 && square < 1) return v / std::sqrt(square);
  }
}

// Three perpendicular unit vectors with a random turn.
std::array<Vec3, 3> random_axes(Random& random) {
  const Vec3 a = random_direction(random);
  Vec3 across = a.cross(random_direction(random));
  while (across.squaredNorm() < 0.01) across = a.cross(random_direction(random));
  const Vec3 b = across / std::sqrt(across.squaredNorm());
  HAIRNET_ASSERT(std::abs(a.squaredNorm() - 1) < kWindAxisTolerance);
  HAIRNET_ASSERT(std::abs(a.dot(b)) < kWindAxisTolerance);
  return {a, b, a.cross(b)};
}

}  // namespace

std::string validate(const Wind& wind) {
  const Vec3& mean = wind.mean_m_per_s;
  // Each has the value's name with its unit, the value, and the least and the most that it may be. The components also
  // have the smallest size beside 0.
  return out_of_range(std::array<NumberRange, 8>{{
      {"wind speed along x (m/s)", mean.x(), -kSpeedMax_m_per_s, kSpeedMax_m_per_s, kComponentMin_m_per_s},
      {"wind speed along y (m/s)", mean.y(), -kSpeedMax_m_per_s, kSpeedMax_m_per_s, kComponentMin_m_per_s},
      {"wind speed along z (m/s)", mean.z(), -kSpeedMax_m_per_s, kSpeedMax_m_per_s, kComponentMin_m_per_s},
      {"wind speed (m/s)", mean.norm(), 0, kSpeedMax_m_per_s},
      {"gust ratio", wind.gust_ratio, 0, 1},
      {"gust period (s)", wind.gust_period_s, kGustPeriodMin_s, kGustPeriodMax_s},
      {"turbulence (m/s)", wind.turbulence_rms_m_per_s, 0, kTurbulenceMax_m_per_s},
      {"turbulence scale (m)", wind.turbulence_scale_m, kTurbulenceScaleMin_m, kTurbulenceScaleMax_m},
  }});
}

bool is_still(const Wind& wind) {
  return wind.mean_m_per_s == Vec3::Zero() && wind.turbulence_rms_m_per_s == 0;
}

// Adds two standard deviations of the turbulence to the strongest gust.
double gust_m_per_s(const Wind& wind) {
  return (1 + wind.gust_ratio) * wind.mean_m_per_s.norm() + 2 * wind.turbulence_rms_m_per_s;
}

WindField::WindField(const Wind& wind) : is_carried_(wind.carried) {
  HAIRNET_ASSERT(validate(wind).empty());
  const bool is_moving = wind.mean_m_per_s != Vec3::Zero();
  if (hairnet::is_still(wind)) return;
  auto modes = std::make_shared<Modes>();
  modes->mean = wind.mean_m_per_s;
  if (is_moving && wind.gust_ratio > 0) {
    Random random(wind.seed, 0);
    modes->gust_ratio = wind.gust_ratio;
    // The periods have no rational ratios, so that gusts do not repeat regularly; shares sum to 1, so |g| <= 1.
    for (const auto& [quicker, share] : {std::pair{1.0, 0.5}, {2.236, 0.3}, {4.583, 0.2}}) {
      modes->gusts.push_back({quicker / wind.gust_period_s, random.unit(), share});
    }
  }
  if (wind.turbulence_rms_m_per_s > 0) {
    Random random(wind.seed, 1);
    // A component's mean square is sum_m |a_m . e|^2 / 2, and each set of six has sum_m a_m a_m^T = 2 a^2 I.
    const double amplitude = wind.turbulence_rms_m_per_s / std::sqrt(double{kEddySets});
    for (int set = 0; set < kEddySets; ++set) {
      const std::array<Vec3, 3> axes = random_axes(random);
      for (std::size_t along = 0; along < 3; ++along) {
        for (std::size_t aside = 1; aside < 3; ++aside) {
          const double wave_number = random.between(0.25, 1) / (kTurn * wind.turbulence_scale_m);
          // An eddy turns over in about its own length divided by its speed.
          const double turnover_hz = wave_number * wind.turbulence_rms_m_per_s;
          modes->turbulence.push_back({wave_number * axes[along], amplitude * axes[(along + aside) % 3],
                                       turnover_hz * random.symmetric(), random.unit()});
        }
      }
    }
    HAIRNET_ASSERT(modes->turbulence.size() == kEddySets * kEddiesPerSet);
  }
  modes_ = std::move(modes);
}

Vec3 WindField::velocity(const Vec3& point_world, double time_s) const {
  HAIRNET_ASSERT(std::isfinite(time_s));
  if (!modes_) return Vec3::Zero();
  // These are g and its integral over time.
  double gust = 0, gust_sum_s = 0;
  for (const Gust& g : modes_->gusts) {
    const double turns = g.frequency_hz * time_s + g.phase;
    gust += g.share * cosine(turns);
    gust_sum_s += g.share * sine(turns) / (kTurn * g.frequency_hz);
  }
  Vec3 velocity = (1 + modes_->gust_ratio * gust) * modes_->mean;
  // Gusts carry the eddies too, so X(t) is the integral of the mean with its gusts.
  const Vec3 carried = point_world - (time_s + modes_->gust_ratio * gust_sum_s) * modes_->mean;  // x - X(t)
  for (const Eddy& eddy : modes_->turbulence) {
    velocity += cosine(eddy.wave_vector.dot(carried) + eddy.frequency_hz * time_s + eddy.phase) * eddy.amplitude;
  }
  return velocity;
}

Vec3f LatticeWind::at(const Vec3f& fraction) const {
  HAIRNET_VALIDATE(fraction.minCoeff() >= -kFractionRounding);
  HAIRNET_VALIDATE(fraction.maxCoeff() <= 1 + kFractionRounding);
  const auto mix = [](const Vec3f& a, const Vec3f& b, float t) { return Vec3f(a + t * (b - a)); };
  const auto edge = [&](std::size_t corner) { return mix(corners[corner], corners[corner + 1], fraction[0]); };
  return mix(mix(edge(0), edge(2), fraction[1]), mix(edge(4), edge(6), fraction[1]), fraction[2]);
}

LatticeWind wind_on(const WindField& field, const Lattice& lattice, const RigidTransform& head, double time_s,
                    const Vec3& head_velocity) {
  LatticeWind wind;
  if (!field.acts()) return wind;
  const Quat to_head = head.rotation.conjugate();
  const Vec3 carried = field.is_carried() ? head_velocity : Vec3::Zero();
  // Carried air is sampled in the vehicle's frame, at its origin, so a ride does not run through the turbulence.
  const Vec3 place = field.is_carried() ? Vec3::Zero() : head.position;
  // Steady wind and gusts are the same everywhere, so one sample serves all corners.
  if (!field.is_turbulent()) {
    wind.corners.fill((to_head * field.velocity(place, time_s) + carried).cast<float>());
    return wind;
  }
  const Vec3 origin = lattice.origin.cast<double>();
  const Vec3 size =
      lattice.spacing.cast<double>().cwiseProduct(Vec3(lattice.dims[0] - 1, lattice.dims[1] - 1, lattice.dims[2] - 1));
  for (std::size_t corner = 0; corner < wind.corners.size(); ++corner) {
    const Vec3 sides(corner & 1 ? 1 : 0, corner & 2 ? 1 : 0, corner & 4 ? 1 : 0);
    const Vec3 point = place + head.rotation * (origin + sides.cwiseProduct(size));
    wind.corners[corner] = (to_head * field.velocity(point, time_s) + carried).cast<float>();
  }
  return wind;
}

}  // namespace hairnet
