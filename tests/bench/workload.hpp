#pragma once

#include <vector>

#include "core/pose/motion.hpp"
#include "core/solver/step.hpp"

namespace hairnet::bench {

// One character in the middle of a lively motion: its lattice after one second of the motion, and the frames to come.
struct BenchCharacter {
  LatticeState state;
  // The poses at the start of the first frame and at the end of each.
  std::vector<Pose> poses;
};

// The characters of a benchmark; each starts at a different time of the motion. All have `frame_count` frames of
// `frame_s` to step.
struct Workload {
  double frame_s = 0;
  std::size_t frame_count = 0;
  std::vector<BenchCharacter> characters;
};

struct WorkloadSpec {
  double rate_hz = 25;
  std::size_t player_count = 64, frame_count = 2;
};

// Starts each character at rest at its own time and steps it through one second with the shipped solver at
// `iterations`.
Workload make_workload(const Level& level, const Motion& motion, const WorkloadSpec& spec, int iterations);

// Returns the time of the motion at which character `index` of `count` starts. All start times differ, and leave
// `span_s` of the motion to play. A motion that is too short stays at its last pose.
double start_time_s(const Motion& motion, std::size_t index, std::size_t count, double span_s);

// Returns the input of step number `step` of the `step_count` equal steps into which frame number `frame` is divided.
StepInput step_input(const Workload& cast, const BenchCharacter& character, std::size_t frame, int step,
                     int step_count);

}  // namespace hairnet::bench
