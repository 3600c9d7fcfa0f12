#pragma once

#include <functional>
#include <string>
#include <vector>

namespace hairnet::bench {

// The timed code: `perform` alone, each time from the state that `rewind` sets.
struct TimedRun {
  std::string name;
  std::function<void()> rewind, perform;
  double seconds_min = 0;  // measured
};

// The least time of each over `repetitions`, which are taken in turns, so that a busy moment hits all alike.
void measure(std::vector<TimedRun>& laps, int repetitions);

}  // namespace hairnet::bench
