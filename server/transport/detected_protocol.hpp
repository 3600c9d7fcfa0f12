#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace hairnet::server {

// The protocol that a peer speaks, detected from its first bytes.
enum class DetectedProtocol : std::uint8_t {
  // More bytes are needed, never more than kProtocolBytesMax.
  unknown,
  // A packet's size prefix.
  packets,
  // A method's name. As a size prefix it is at least 0x20000000, far beyond any packet.
  http,
  // A handshake record. As a size prefix it is at least 66326, far beyond any first message.
  tls,
};

inline constexpr std::size_t kProtocolBytesMax = 4;

DetectedProtocol detect_protocol(std::span<const std::uint8_t> first);

}  // namespace hairnet::server
