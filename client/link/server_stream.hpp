#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "client/link/address.hpp"

// The interface of a connection to a server, over any transport. Only sources that use Asio include it.
namespace hairnet::link {

namespace asio = boost::asio;

// One connection over one of the transports. Everything on the thread of its io_context.
class ServerStream {
 public:
  struct Read {
    std::span<const std::uint8_t> bytes;  // valid until the next read
    std::string fault;                    // one line, if the connection has ended
  };

  virtual ~ServerStream() = default;
  // Resolves, connects, shakes hands. Returns an empty string, or one line with the reason of the failure.
  virtual asio::awaitable<std::string> open() = 0;
  // Reads a piece of the stream, or one message if the transport has messages.
  virtual asio::awaitable<Read> read() = 0;
  // For a transport with messages, `bytes` is one packet. Returns false when the connection has ended; read() then
  // returns the reason.
  virtual asio::awaitable<bool> write(std::span<const std::uint8_t> bytes) = 0;
  virtual void half_close() = 0;  // nothing more will be written
  virtual void close() = 0;       // pending operations end soon
  [[nodiscard]] virtual bool has_messages() const = 0;
};

std::unique_ptr<ServerStream> make_packet_stream(asio::io_context& io, const Address& address, const TlsOptions& tls);
std::unique_ptr<ServerStream> make_web_socket_stream(asio::io_context& io, const Address& address,
                                                     const TlsOptions& tls);
// Makes a stream of the address's kind.
std::unique_ptr<ServerStream> make_server_stream(asio::io_context& io, const Address& address, const TlsOptions& tls);

}  // namespace hairnet::link
