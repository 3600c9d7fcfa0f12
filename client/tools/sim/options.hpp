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

// `standard` is what servers run; its name for users is "default", a word that C++ keeps for itself. `converged` solves
// each step's system in double, for comparison.
enum class Solver : std::uint8_t { standard, converged };

// A clip simulated without a server. Files with empty names are not written. Values are within their ranges.
struct SimulateOptions {
  std::string groom, motion;
  HairstyleOptions hairstyle;
  // How a strand file of another program is read; it means nothing for a groom file.
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
  // The material that replaces the groom's own; none: the groom keeps its own.
  std::optional<Material> material;
  // Time after the clip, s: the head eases upright within 1 s, then is still.
  double settle_s = 0;
  // `out` gets the strands where it is a file of a motion (is_exported_motion), else the nodes as a .npy. The next
  // three are .npy files, too: the velocities of the nodes, the points of the deformed strands, and the poses of the
  // bones. `dump_model` gets the model as JSON. README.md has the layout of each.
  std::string out, velocities, points, poses, dump_model;
};

// The replay of a server's recording: its rate, level, materials and wind are those of the recording.
struct ReplayOptions {
  std::string recording;
  // The file of one character's nodes (.npy), or of its strands (exported_motion_extensions).
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
