#include "server/transport/peer_address.hpp"

#include <sstream>

namespace hairnet::server {

// A socket that takes IPv4 and IPv6 shows IPv4 peers as ::ffff:a.b.c.d, which would be one /64 for all of them.
asio::ip::address unmapped(const asio::ip::address& address) {
  if (address.is_v6() && address.to_v6().is_v4_mapped()) return make_address_v4(asio::ip::v4_mapped, address.to_v6());
  return address;
}

std::uint64_t address_number(const asio::ip::address& address) {
  const asio::ip::address plain = unmapped(address);
  // The mapped form ::ffff:a.b.c.d has these bits in its lower half; as an upper half they name a network that is not
  // assigned.
  if (plain.is_v4()) return 0xffff'0000'0000u | plain.to_v4().to_uint();
  std::uint64_t network = 0;
  for (std::size_t i = 0; i < 8; ++i) network = network << 8 | plain.to_v6().to_bytes()[i];
  return network;
}

std::string network_of(const asio::ip::address& address) {
  const asio::ip::address plain = unmapped(address);
  return plain.is_v4() ? plain.to_string() : make_network_v6(plain.to_v6(), 64).canonical().to_string();
}

std::string shown(const asio::ip::tcp::endpoint& endpoint) {
  std::ostringstream text;
  text << asio::ip::tcp::endpoint(unmapped(endpoint.address()), endpoint.port());
  return text.str();
}

}  // namespace hairnet::server
