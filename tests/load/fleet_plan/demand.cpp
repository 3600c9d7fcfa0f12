#include "tests/load/fleet_plan/demand.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hairnet::fleet_plan {
namespace {

constexpr std::size_t kDayMinutes = 1440;
// Sessions of more than 20 days are left out of the mean number of people.
constexpr std::size_t kTailMinutes = 20 * kDayMinutes;

std::size_t minute_of_day(double time_s) {
  return static_cast<std::size_t>(std::max(0.0, time_s) / 60) % kDayMinutes;
}

}  // namespace

double exponential(Random& random) {
  return -std::log(1 - random.unit());
}

Demand::Demand(const Settings& s)
    : mu_(std::log(s.session_min * 60) - s.session_sigma * s.session_sigma / 2),
      sigma_(s.session_sigma),
      rate_(kDayMinutes),
      people_(kDayMinutes) {
  for (std::size_t m = 0; m < kDayMinutes; ++m) {
    // The curve is a squared cosine bell: 1 at the peak hour, night_share twelve hours later.
    const double phase = 2 * std::numbers::pi * (static_cast<double>(m) / 60 - s.peak_hour) / 24;
    const double height = (1 + std::cos(phase)) / 2;
    rate_[m] = s.night_share + (1 - s.night_share) * height * height;
  }
  // In a minute with one arrival per second 60 people come. `stay[u]` says how many of them are there u minutes later,
  // modulo a day: 60 times the share of sessions longer than u, erfc(ln(u / median) / (sigma sqrt 2)) / 2.
  std::vector<double> stay(kDayMinutes, 0);
  for (std::size_t u = 0; u < kTailMinutes; ++u) {
    const double age_s = (static_cast<double>(u) + 0.5) * 60;
    const double share = sigma_ > 0 ? std::erfc((std::log(age_s) - mu_) / (sigma_ * std::numbers::sqrt2)) / 2
                                    : (std::log(age_s) < mu_ ? 1.0 : 0.0);
    stay[u % kDayMinutes] += share * 60;
    // What is left adds nothing that could be seen among 100 000 people.
    if (share < 1e-9) break;
  }
  for (std::size_t m = 0; m < kDayMinutes; ++m)
    for (std::size_t u = 0; u < kDayMinutes; ++u) people_[m] += rate_[(m + kDayMinutes - u) % kDayMinutes] * stay[u];
  const double scale = s.peak / *std::ranges::max_element(people_);
  for (double& rate : rate_) rate *= scale;
  for (double& people : people_) people *= scale;

  double sum = 0;
  for (std::uint32_t k = 0; k < s.rooms; ++k) room_sums_.push_back(sum += std::pow(k + 1.0, -s.zipf));
  for (double& share : room_sums_) share /= sum;
}

double Demand::arrivals_per_s(double time_s) const {
  return rate_[minute_of_day(time_s)];
}

double Demand::mean_people(double time_s) const {
  return people_[minute_of_day(time_s)];
}

double Demand::session_s(Random& random) const {
  const double radius = std::sqrt(2 * exponential(random)), angle = 2 * std::numbers::pi * random.unit();
  // `radius * cos(angle)` has the standard normal distribution, by the method of Box and Muller.
  return std::exp(mu_ + sigma_ * radius * std::cos(angle));
}

std::uint32_t Demand::room(Random& random) const {
  const auto found = std::ranges::upper_bound(room_sums_, random.unit());
  return static_cast<std::uint32_t>(std::min<std::ptrdiff_t>(found - room_sums_.begin(), std::ssize(room_sums_) - 1));
}

double Demand::room_share(std::uint32_t room) const {
  return room_sums_[room] - (room > 0 ? room_sums_[room - 1] : 0);
}

}  // namespace hairnet::fleet_plan
