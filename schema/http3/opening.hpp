#pragma once

#include <cstdint>
#include <string_view>

#include "schema/http3/varint.hpp"

namespace hairnet::http3 {

// Makes the HEADERS frame of an extended CONNECT, with which a client opens a session. `origin` is that of the page
// that asks; empty for programs.
Bytes connect_request(std::string_view authority, std::string_view path, std::string_view origin = "");

// Makes the first bytes of a session's channel.
Bytes channel_begin(std::uint64_t session);

// Makes the first bytes of each other stream of the session. The server opens those, for its own bytes alone.
Bytes one_way_begin(std::uint64_t session);

}  // namespace hairnet::http3
