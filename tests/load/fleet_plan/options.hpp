#pragma once

#include <string>
#include <variant>

#include "tests/load/fleet_plan/settings.hpp"

namespace hairnet::fleet_plan {

struct Options {
  Settings settings;
  std::string json, page;  // files, or empty
  std::string command;     // as given
};

// The options, or the exit status when there is nothing more to do.
std::variant<Options, int> parse_options(int argc, const char* const* argv);

}  // namespace hairnet::fleet_plan
