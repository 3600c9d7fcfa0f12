#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace hairnet::server {

// The protocol that a peer speaks, detected from its first bytes.
enum class DetectedProtocol : std::uint8_t {
  unknown,  // more bytes are needed, never more than kProtocolBytesMax
  packets,  // a packet's size prefix
  http,     // a method's name; as a size prefix at least 0x20000000, far beyond any packet
  tls,      // a handshake record; as a size prefix at least 66326, far beyond any first message
};

inline constexpr std::size_t kProtocolBytesMax = 4;

DetectedProtocol detect_protocol(std::span<const std::uint8_t> first);

}  // namespace hairnet::server
