#pragma once

#include <cstdint>
#include <vector>

#include "core/random.hpp"
#include "tests/load/fleet_plan/settings.hpp"

namespace hairnet::fleet_plan {

// Says how many people come at which time of the day, to which room, and for how long they stay. The caller owns the
// random numbers, so that one seed fixes a whole simulation.
class Demand {
 public:
  explicit Demand(const Settings& settings);

  // Returns the mean number of arrivals per second. `time_s` counts from midnight of the first day. The rates are such
  // that Settings::peak people are there on average in the busiest minute of a day, if nobody is turned away.
  [[nodiscard]] double arrivals_per_s(double time_s) const;
  // Returns the mean number of people who are there at `time_s`. It adds up the earlier arrivals, each weighted with
  // the share of sessions that last until then.
  [[nodiscard]] double mean_people(double time_s) const;

  // Returns a random length of a session, from a log-normal distribution.
  [[nodiscard]] double session_s(Random& random) const;
  // Returns a random room by Zipf's law; room 0 is the most popular one.
  [[nodiscard]] std::uint32_t room(Random& random) const;
  // Returns the share of all people who choose this room.
  [[nodiscard]] double room_share(std::uint32_t room) const;

 private:
  // The mean and the standard deviation of the logarithm of a session's length in seconds.
  double mu_, sigma_;
  // The arrivals per second and the mean number of people, for each minute of the day.
  std::vector<double> rate_;
  std::vector<double> people_;
  // Element k is the share of people who choose one of the rooms 0 to k.
  std::vector<double> room_sums_;
};

// Returns an exponentially distributed number with mean 1: the waiting time between the events of a Poisson process.
double exponential(Random& random);

}  // namespace hairnet::fleet_plan
