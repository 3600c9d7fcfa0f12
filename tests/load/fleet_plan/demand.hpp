#pragma once

#include <cstdint>
#include <vector>

#include "core/random.hpp"
#include "tests/load/fleet_plan/settings.hpp"

namespace hairnet::fleet_plan {

// Who comes when, to which room, and for how long. The random numbers are the caller's.
class Demand {
 public:
  explicit Demand(const Settings& settings);

  // Arrivals a second at a time since midnight of the first day. Scaled so that the mean number of people at the
  // busiest minute of a day is `peak`, if nobody is turned away.
  [[nodiscard]] double arrivals_per_s(double time_s) const;
  // The mean number of people at a time, from the rates before it and the share of sessions that last so long.
  [[nodiscard]] double mean_people(double time_s) const;

  [[nodiscard]] double session_s(Random& random) const;
  [[nodiscard]] std::uint32_t room(Random& random) const;
  [[nodiscard]] double room_share(std::uint32_t room) const;

 private:
  double mu_, sigma_;
  std::vector<double> rate_;       // a second, by minute of the day
  std::vector<double> people_;     // by minute of the day
  std::vector<double> room_sums_;  // cumulated shares
};

// Exponential with mean 1.
double exponential(Random& random);

}  // namespace hairnet::fleet_plan
