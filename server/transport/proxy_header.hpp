#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "server/transport/asio.hpp"

namespace hairnet::server {

// The header of the PROXY protocol, version 1 or 2, with which a proxy begins a connection that it passes on
// (https://www.haproxy.org/download/2.9/doc/proxy-protocol.txt).
struct ProxyHeader {
  enum class Status : std::uint8_t {
    // More bytes are needed, never more than kProxyHeaderBytesMax.
    incomplete,
    malformed,
    complete,
  };
  Status status = Status::incomplete;
  // The length of a complete header.
  std::size_t bytes = 0;
  // The client's address. None: the connection is the proxy's own, or is not of TCP.
  std::optional<asio::ip::tcp::endpoint> peer = {};
};

// Proxies add values of type, length and value behind the addresses; this is room for 2 KB of them.
inline constexpr std::size_t kProxyHeaderBytesMax = 2048;

// Reads the header at the front of `first`, which holds all bytes that have come so far. Asserts that it needs no more
// than kProxyHeaderBytesMax. The header is not signed: believe it only on connections of listed proxies.
ProxyHeader parse_proxy_header(std::span<const std::uint8_t> first);

}  // namespace hairnet::server
