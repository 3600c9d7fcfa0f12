#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace hairnet::fidelity {

// Writes a table's rows to `path`, unless that is empty. The exit status: 1, and a line on stderr in the program's
// name, when it cannot.
int write_json(const char* program, const std::string& path, const nlohmann::ordered_json& rows);

}  // namespace hairnet::fidelity
