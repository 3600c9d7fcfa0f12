#pragma once

#include <string>
#include <variant>

#include "tests/load/fleet_plan/settings.hpp"

namespace hairnet::fleet_plan {

struct Options {
  Settings settings;
  // The files for the results; no file is written for an empty name.
  std::string json, page;
  // The command line as it was given.
  std::string command;
};

// The options, or the exit status when there is nothing more to do.
std::variant<Options, int> parse_options(int argc, const char* const* argv);

}  // namespace hairnet::fleet_plan
