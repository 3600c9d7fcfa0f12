#pragma once

#include <memory>

#include "client/hairnet.h"
#include "client/link/link_core.hpp"
#include "client/room/room.hpp"

namespace hairnet::c {

// Connects a room by sockets of the library. On failure writes `error`, and returns what kind it was.
hairnet_error connect(const hairnet_options& options, const link::LinkCoreOptions& core, const wire::Observe& observe,
                      std::unique_ptr<room::Room>& room, char* error, std::size_t error_size);

}  // namespace hairnet::c
