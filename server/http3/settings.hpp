#pragma once

#include <span>
#include <string_view>

#include "server/http3/varint.hpp"

namespace hairnet::http3 {

// The server's control stream up to its SETTINGS: extended CONNECT, datagrams, and WebTransport by the names that its
// drafts have given it: Chromium asks for that of draft 2, others for later ones.
Bytes control_stream_begin();

// Whether the peer's SETTINGS are well formed. Their values change nothing here.
bool are_valid_settings(std::span<const std::uint8_t> payload);

}  // namespace hairnet::http3
