#pragma once

#include <functional>
#include <string>
#include <vector>

namespace hairnet::bench {

// The timed code: `perform` alone, each time from the state that `rewind` sets.
struct TimedRun {
  std::string name;
  std::function<void()> rewind, perform;
  // The result: the shortest time of `perform`.
  double seconds_min = 0;
};

// Measures the shortest time of each run over `repetitions` rounds. Each round has one turn of every run, so that other
// load on the machine slows all runs alike.
void measure(std::vector<TimedRun>& laps, int repetitions);

}  // namespace hairnet::bench
