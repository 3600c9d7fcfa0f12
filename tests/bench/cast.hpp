#pragma once

#include <vector>

#include "core/pose/motion.hpp"
#include "core/solver/step.hpp"

namespace hairnet::bench {

// One character in the middle of a lively motion: its lattice after a second of it, and the frames to come.
struct Player {
  LatticeState state;
  std::vector<Pose> poses;  // at the start of the first frame, and at the end of each
};

// Characters that are all elsewhere in a motion.
struct Cast {
  double frame_s = 0;
  std::size_t frame_count = 0;
  std::vector<Player> players;
};

struct CastSpec {
  double rate_hz = 25;
  std::size_t player_count = 64, frame_count = 2;
};

// Each is led from rest through a second of the motion from its own place on, with the shipped solver at `iterations`.
Cast make_cast(const Level& level, const Motion& motion, const CastSpec& spec, int iterations);

// Where player `index` of `count` begins, so that all are different and `span_s` of the motion is left. Motions that
// are too short are held at their end.
double start_time_s(const Motion& motion, std::size_t index, std::size_t count, double span_s);

// What a player's step `step` of `frame`'s `step_count` is given.
StepInput step_input(const Cast& cast, const Player& player, std::size_t frame, int step, int step_count);

}  // namespace hairnet::bench
