#pragma once

#include <set>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "server/app/setting.hpp"

namespace hairnet::server {

// Sets what the TOML file at `path` names, and returns the names ("section.key"). A file that cannot be read, an
// unknown section or key, a wrong type or a value out of range is refused with one line: file, line, key. Settings that
// come before the fault in the file may have been set by then.
Result<std::set<std::string>> read_config_file(const std::string& path, const std::vector<Setting>& settings);

// A file that sets every setting to the value it has, section by section.
std::string config_file_text(const std::vector<Setting>& settings);

}  // namespace hairnet::server
