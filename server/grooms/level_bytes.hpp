#pragma once

#include <cstddef>

#include "core/levels/level.hpp"

namespace hairnet::server {

// Of memory, near enough.
std::size_t level_bytes(const LevelSet& set);

}  // namespace hairnet::server
