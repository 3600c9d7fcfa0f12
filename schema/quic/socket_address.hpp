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
  // Zero means none.
  socklen_t bytes = 0;

  Address() : v6{} {}
  // Asserts that the address is of one of the two kinds.
  static Address of(const sockaddr* address, socklen_t bytes);

  [[nodiscard]] std::uint16_t port() const;
  // Returns a text such as "192.0.2.1:7420" or "[2001:db8::1]:7420".
  [[nodiscard]] std::string text() const;
  [[nodiscard]] ngtcp2_addr native() { return {&any, bytes}; }
  bool operator==(const Address& other) const;
};

// The two ends of a datagram.
struct Path {
  Address local, remote;
  bool operator==(const Path&) const = default;
};

}  // namespace hairnet::quic
