#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "server/fleet/server_status.hpp"

namespace hairnet::server {

// A server with a smaller free share, or without a place for one more character, is full. The value lies below
// kAnnouncedShareMin (1/16), so a server that can still make hair coarser is not full.
inline constexpr double kFreeShareMin = 0.05;

// The server that should own a room which no server owns: rendezvous hashing (the highest score of all servers wins),
// weighted by the free share. Full and draining servers get none; empty when all are. A server with a big room gets
// another one only where no other server takes it; a big room goes to a server without rooms, where there is one. The
// same list in any order gives the same server. When a server joins, leaves or fills up, only rooms from or to this
// server move.
std::optional<std::uint64_t> choose_server(std::string_view room, std::span<const ServerStatus> servers,
                                           bool is_big = false);

}  // namespace hairnet::server
