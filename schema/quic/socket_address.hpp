#pragma once

#include <netinet/in.h>
#include <ngtcp2/ngtcp2.h>
#include <sys/socket.h>

#include <cstdint>
#include <string>

namespace hairnet::quic {

// An IPv4 or IPv6 address with its port, as system calls take it.
struct Address {
  union {
    sockaddr any;
    sockaddr_in v4;
    sockaddr_in6 v6;
  };
  socklen_t bytes = 0;  // 0: none

  Address() : v6{} {}
  static Address of(const sockaddr* address, socklen_t bytes);  // asserts that it is of one of the two kinds

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::string text() const;  // "192.0.2.1:7420", "[2001:db8::1]:7420"
  [[nodiscard]] ngtcp2_addr native() { return {&any, bytes}; }
  bool operator==(const Address& other) const;
};

// The two ends of a datagram.
struct Path {
  Address local, remote;
  bool operator==(const Path&) const = default;
};

}  // namespace hairnet::quic
