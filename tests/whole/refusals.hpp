#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace hairnet::whole {

// The refusals that must occur in some hundred outcomes, one line each, and do not: each kind of bad client must do
// what the server refuses. `events`: the sums of Outcome::events.
std::vector<std::string> missing_refusals(const std::map<std::string, std::uint64_t>& events);

}  // namespace hairnet::whole
