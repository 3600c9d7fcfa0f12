#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>

#include "tests/load/client_connection.hpp"
#include "tests/load/tcp_client_connection.hpp"

namespace hairnet::load {

enum class Transport : std::uint8_t { tcp, tls, ws, webtransport };
inline constexpr std::array<std::string_view, 4> kTransportNames{"tcp", "tls", "ws", "webtransport"};

// Connections over any transport of the client library, on one thread. Certificates are not checked, except by what the
// server's page about WebTransport names; that page is asked for again when a connection fails.
std::unique_ptr<Connector> make_connector(asio::io_context& io, Transport transport, const Address& server,
                                          const asio::ip::tcp::endpoint& endpoint);

}  // namespace hairnet::load
