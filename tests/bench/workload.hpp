#pragma once

#include <vector>

#include "core/pose/motion.hpp"
#include "core/solver/step.hpp"

namespace hairnet::bench {

// One character in the middle of a lively motion: its lattice after one second of the motion, and the frames to come.
struct BenchCharacter {
  LatticeState state;
  // Holds the poses at the start of the first frame and at the end of each.
  std::vector<Pose> poses;
};

// The characters of a benchmark; each starts at a different time of the motion.
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

// The start time of character `index` of `count`: all differ, and `span_s` of the motion is left. A motion that is too
// short stays at its last pose.
double start_time_s(const Motion& motion, std::size_t index, std::size_t count, double span_s);

// The input of a character's step `step` of the `step_count` steps of `frame`.
StepInput step_input(const Workload& cast, const BenchCharacter& character, std::size_t frame, int step,
                     int step_count);

}  // namespace hairnet::bench
