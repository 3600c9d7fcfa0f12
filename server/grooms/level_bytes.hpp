#pragma once

#include <cstddef>

#include "core/levels/level.hpp"

namespace hairnet::server {

// The memory of the levels, approximately, in bytes.
std::size_t level_bytes(const LevelSet& set);

}  // namespace hairnet::server
