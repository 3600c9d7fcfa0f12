#pragma once

#include <string>

#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet::groom {

// Writes the groom's file, whole or not at all. The groom must pass validate(). The error names the file.
Result<void> write_groom(const Groom& groom, const std::string& path);
// Does the same and prints its name and size on stdout.
Result<void> save_groom(const Groom& groom, const std::string& path);

}  // namespace hairnet::groom
