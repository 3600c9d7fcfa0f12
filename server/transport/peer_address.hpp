#pragma once

#include <cstdint>
#include <string>

#include "server/transport/asio.hpp"

namespace hairnet::server {

// The IPv4 address that an IPv6 address maps; every other address as it is.
asio::ip::address unmapped(const asio::ip::address& address);

// One number for an IPv4 address or an IPv6 /64 network. IPv4 addresses use a range that no IPv6 network has. A
// provider gives each customer a /64 at least, so limits by single IPv6 addresses would limit nobody.
std::uint64_t address_number(const asio::ip::address& address);

// The address or network as text: "192.0.2.1", "2001:db8:1:2::/64".
std::string network_of(const asio::ip::address& address);

// "address:port" for the log.
std::string shown(const asio::ip::tcp::endpoint& endpoint);

}  // namespace hairnet::server
