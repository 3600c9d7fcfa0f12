#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace hairnet::fidelity {

// Says on stderr why a section ends, and returns the exit status.
int fail(const std::string& reason);

// Writes a table's rows to `path`, unless that is empty. The exit status: that of fail() when it cannot.
int write_json(const std::string& path, const nlohmann::ordered_json& rows);

}  // namespace hairnet::fidelity
