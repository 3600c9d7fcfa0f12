#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>

#include "schema/http3/varint.hpp"

namespace hairnet::http3 {

// SETTINGS_ENABLE_CONNECT_PROTOCOL (RFC 9220), which a session needs of the server, and SETTINGS_H3_DATAGRAM (RFC
// 9297), by which either end says that it takes datagrams.
inline constexpr std::uint64_t kEnableConnectProtocol = 0x08, kH3Datagram = 0x33;

// Makes the bytes of a control stream up to and with its SETTINGS: extended CONNECT, datagrams, and WebTransport by
// each name that a draft gave it. Chromium asks for the name of draft 2, others for later ones.
Bytes control_stream_begin();

// Returns the values by name; none when the payload is not well formed.
std::optional<std::map<std::uint64_t, std::uint64_t>> read_settings(std::span<const std::uint8_t> payload);

}  // namespace hairnet::http3
