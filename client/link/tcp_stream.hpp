#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <vector>

#include "client/link/server_stream.hpp"

namespace hairnet::link {

// Resolves and connects. Empty, or one line that says why not.
asio::awaitable<std::string> connect_socket(asio::ip::tcp::socket& socket, const Address& address);

// What has ended a connection, for people.
std::string plain_fault(const boost::system::error_code& error, const Address& address);

// Size-prefixed packets one after the other.
class TcpStream : public ServerStream {
 public:
  TcpStream(asio::io_context& io, Address address);
  asio::awaitable<std::string> open() override;
  asio::awaitable<Read> read() override;
  asio::awaitable<bool> write(std::span<const std::uint8_t> bytes) override;
  void half_close() override;
  void close() override;
  [[nodiscard]] bool has_messages() const override { return false; }

 private:
  const Address address_;
  asio::ip::tcp::socket socket_;
  std::vector<std::uint8_t> buffer_;
};

}  // namespace hairnet::link
