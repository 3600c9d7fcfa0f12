#include "schema/quic/socket_address.hpp"

#include <arpa/inet.h>

#include <array>
#include <cstring>

#include "core/assert.hpp"

namespace hairnet::quic {

Address Address::of(const sockaddr* address, socklen_t bytes) {
  HAIRNET_ASSERT(address->sa_family == AF_INET || address->sa_family == AF_INET6);
  HAIRNET_ASSERT(bytes == (address->sa_family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6)));
  Address made;
  std::memcpy(&made.v6, address, bytes);
  made.bytes = bytes;
  return made;
}

std::uint16_t Address::port() const {
  return ntohs(any.sa_family == AF_INET ? v4.sin_port : v6.sin6_port);
}

std::string Address::text() const {
  if (bytes == 0) return "none";
  std::array<char, INET6_ADDRSTRLEN> host{};
  if (any.sa_family == AF_INET) {
    inet_ntop(AF_INET, &v4.sin_addr, host.data(), host.size());
    return std::string(host.data()) + ":" + std::to_string(port());
  }
  inet_ntop(AF_INET6, &v6.sin6_addr, host.data(), host.size());
  return "[" + std::string(host.data()) + "]:" + std::to_string(port());
}

bool Address::operator==(const Address& other) const {
  if (bytes != other.bytes) return false;
  if (bytes == 0) return true;
  // The fields are compared one by one, since the structs have padding and fields that say nothing about the peer.
  if (any.sa_family != other.any.sa_family || port() != other.port()) return false;
  if (any.sa_family == AF_INET) return v4.sin_addr.s_addr == other.v4.sin_addr.s_addr;
  return std::memcmp(&v6.sin6_addr, &other.v6.sin6_addr, sizeof(v6.sin6_addr)) == 0 &&
         v6.sin6_scope_id == other.v6.sin6_scope_id;
}

}  // namespace hairnet::quic
