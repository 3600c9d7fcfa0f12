#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>

#include "schema/http3/varint.hpp"

namespace hairnet::http3 {

// SETTINGS that a session needs of the server, and the client's wish for datagrams.
inline constexpr std::uint64_t kEnableConnectProtocol = 0x08, kH3Datagram = 0x33;

// A control stream up to its SETTINGS: extended CONNECT, datagrams, and WebTransport by the names that its drafts have
// given it: Chromium asks for that of draft 2, others for later ones.
Bytes control_stream_begin();

// The values by name. None when the payload is not well formed.
std::optional<std::map<std::uint64_t, std::uint64_t>> read_settings(std::span<const std::uint8_t> payload);

}  // namespace hairnet::http3
