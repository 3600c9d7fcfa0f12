#pragma once

#include <string>
#include <variant>
#include <vector>

#include "core/build/level.hpp"

namespace hairnet::fidelity {

struct CollisionsOptions {
  std::vector<std::string> grooms, motions;
  std::vector<LevelIndex> levels{LevelIndex::high, LevelIndex::low};
  double duration_s = 6;  // at most, of each motion
  std::string json;       // file, or empty
};

// The options, or the exit code when there is nothing more to do.
std::variant<CollisionsOptions, int> parse_collisions_options(int argc, char** argv);

}  // namespace hairnet::fidelity
