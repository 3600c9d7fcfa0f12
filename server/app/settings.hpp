#pragma once

#include <vector>

#include "server/app/config.hpp"
#include "server/app/setting.hpp"

namespace hairnet::server {

// Everything that can be set, in the order of the file: sections together. They point into `config`, which must
// outlive them. A new setting is a member of Config and a line here; flags, file, ranges and --help follow from that.
std::vector<Setting> settings_of(Config& config);

}  // namespace hairnet::server
