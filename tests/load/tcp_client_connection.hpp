#pragma once

#include <boost/asio.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "tests/load/client_connection.hpp"

namespace hairnet::load {

namespace asio = boost::asio;

// Where the server is.
struct Address {
  std::string host = "127.0.0.1";
  std::uint16_t port = 7420;
};
Result<asio::ip::tcp::endpoint> resolve(const Address& address);

// Thousands of TCP connections on one thread: a socket without a byte to read costs no buffer, what can be sent at once
// is, and one buffer receives for all.
class TcpConnector final : public Connector {
 public:
  TcpConnector(asio::io_context& io, asio::ip::tcp::endpoint server);
  std::unique_ptr<ClientConnection> connect(ConnectionEvents& events, std::uint32_t host) override;

 private:
  asio::io_context* io_;
  asio::ip::tcp::endpoint server_;
  std::shared_ptr<std::vector<std::uint8_t>> receive_buffer_;
};

}  // namespace hairnet::load
