#pragma once

#include <functional>
#include <string>
#include <vector>

namespace hairnet::bench {

// What is timed: `perform` alone, each time from where `rewind` puts it.
struct TimedRun {
  std::string name;
  std::function<void()> rewind, perform;
  double seconds_min = 0;  // measured
};

// The least time of each over `repetitions`, which are taken in turns, so that a busy moment hits all alike.
void measure(std::vector<TimedRun>& laps, int repetitions);

}  // namespace hairnet::bench
