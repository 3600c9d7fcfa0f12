#pragma once

#include <set>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "server/app/setting.hpp"

namespace hairnet::server {

// Sets the values of the TOML file at `path`, and returns their names ("section.key"). An unreadable file, an unknown
// section or key, a wrong type or a value out of range gives an error of one line: file, line, key. Settings before the
// error in the file may have been set by then.
Result<std::set<std::string>> read_config_file(const std::string& path, const std::vector<Setting>& settings);

// The text of a file that sets every setting to its current value, section by section.
std::string config_file_text(const std::vector<Setting>& settings);

}  // namespace hairnet::server
