#pragma once

#include <cstdint>
#include <string_view>

#include "schema/http3/varint.hpp"

namespace hairnet::http3 {

// What a client opens a session with: the HEADERS frame of an extended CONNECT. `origin`: of the page that asks; empty
// for programs.
Bytes connect_request(std::string_view authority, std::string_view path, std::string_view origin = "");

// What the session's channel begins with.
Bytes channel_begin(std::uint64_t session);

// What another stream of the session begins with, which the server opens for itself alone.
Bytes one_way_begin(std::uint64_t session);

}  // namespace hairnet::http3
