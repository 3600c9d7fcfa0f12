#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "client/assets/import/bvh.hpp"
#include "client/assets/import/hair_import.hpp"
#include "client/assets/made/made.hpp"
#include "core/levels/level.hpp"
#include "core/solver/step.hpp"

namespace hairnet::sim {

// `standard` is what servers run; `converged` solves each step's system in double, for comparison.
enum class Solver : std::uint8_t { standard, converged };

// A clip simulated without a server. Files with empty names are not written. Values are within their ranges.
struct SimulateOptions {
  std::string groom, motion;
  HairstyleOptions hairstyle;
  // Applies to a strand file of another program.
  HairImport hair;
  BvhImport bvh;
  LevelIndex level = LevelIndex::high;
  Solver solver = Solver::standard;
  double rate_hz = 30;
  // Zero means substep_count_for the rate; after parse_options it is never zero.
  int substep_count = 0;
  // Zero means the level's own.
  int iterations = 0;
  Wind wind;
  // Replaces the groom's own.
  std::optional<Material> material;
  // Is added after the clip, s: the head eases upright within 1 s, then is still.
  double settle_s = 0;
  // `out` gets the strands where it is a file of a motion (is_exported_motion), else the nodes as a .npy.
  std::string out, velocities, points, poses, dump_model;
};

// The replay of a server's recording: its rate, level, materials and wind are those of the recording.
struct ReplayOptions {
  std::string recording;
  // Gets one character's nodes (.npy), or its strands (exported_motion_extensions).
  std::string out;
  // A folder for every frame of every character; empty: none.
  std::string trace;
  // The client's number of the character of `out`, or its session << 32 | number where several have that number.
  std::optional<std::uint64_t> character;
};

using Options = std::variant<SimulateOptions, ReplayOptions>;

// The options of the command line, or the exit code when the program must end at once (help, or a usage error, already
// printed in one line).
std::variant<Options, int> parse_options(int argc, char** argv);

}  // namespace hairnet::sim
