#pragma once

#include <vector>

#include "server/app/config.hpp"
#include "server/app/setting.hpp"

namespace hairnet::server {

// All settings in the order of the file, section by section. They point into `config`, which must outlive them. A new
// setting is a member of Config and a line here; flags, file, ranges and --help follow from these.
std::vector<Setting> settings_of(Config& config);

}  // namespace hairnet::server
