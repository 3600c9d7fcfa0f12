#pragma once

#include <string>

#include "tests/load/fleet_plan/outcome.hpp"
#include "tests/load/fleet_plan/settings.hpp"

namespace hairnet::fleet_plan {

// A table for a terminal.
std::string to_text(const Settings& settings, const Outcome& outcome);
std::string to_json_text(const Settings& settings, const Outcome& outcome, const std::string& command);
// One HTML page that needs nothing beside itself.
std::string to_page(const Settings& settings, const Outcome& outcome, const std::string& command);

// The size of the fleet and what its busiest moment takes, in one sentence.
std::string to_sentence(const Settings& settings, const Outcome& outcome);
std::string number_text(double value);

}  // namespace hairnet::fleet_plan
