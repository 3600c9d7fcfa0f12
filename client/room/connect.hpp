#pragma once

#include <memory>

#include "client/link/link.hpp"
#include "client/room/room.hpp"

namespace hairnet::room {

// Joins a room over sockets of its own (link::Link). Waits for the server's welcome, within the time-out of the
// options; afterwards the room reconnects by itself. The error is one line that says why the first attempt failed.
Result<std::unique_ptr<Room>> connect(const link::LinkOptions& options, const wire::Observe& observe = {});

}  // namespace hairnet::room
