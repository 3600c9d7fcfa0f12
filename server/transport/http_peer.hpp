#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <tuple>

#include "schema/stream/any_stream.hpp"
#include "server/transport/asio.hpp"
#include "server/transport/beast.hpp"

namespace hairnet::server {

// One connection to a server of HTTP/1.1, plain or inside TLS.
class HttpPeer {
 public:
  using Error = boost::system::error_code;

  // `buffer_bytes_max`: what is read and not yet parsed. `tls` may be null, and must outlive the peer.
  HttpPeer(const SerialExecutor& executor, asio::ssl::context* tls, std::size_t buffer_bytes_max)
      : socket_(executor, tls), buffer_(buffer_bytes_max) {}

  // Connects, and with TLS verifies that the certificate is of `host`. `timeout` bounds all of this but the look-up of
  // a name. Call it once, before the other operations.
  asio::awaitable<Error> connect(const std::string& host, std::uint16_t port, std::chrono::milliseconds timeout);

  // The next four carry one operation at a time each, and return its error; an expired time is beast::error::timeout.
  template <class Message>
  asio::awaitable<Error> write(const Message& message) {
    co_return std::get<0>(co_await http::async_write(socket_, message, kAwaitable));
  }
  template <class Parser>
  asio::awaitable<Error> read_header(Parser& parser) {
    co_return std::get<0>(co_await http::async_read_header(socket_, buffer_, parser, kAwaitable));
  }
  template <class Parser>
  asio::awaitable<Error> read(Parser& parser) {
    co_return std::get<0>(co_await http::async_read(socket_, buffer_, parser, kAwaitable));
  }
  template <class Parser>
  asio::awaitable<Error> read_some(Parser& parser) {
    co_return std::get<0>(co_await http::async_read_some(socket_, buffer_, parser, kAwaitable));
  }
  // Bounds the operations that follow.
  void expires_after(std::chrono::milliseconds time) { socket_.plain.expires_after(time); }
  void expires_never() { socket_.plain.expires_never(); }
  // Ends the operation under way; also one that still looks for addresses.
  void close() {
    is_closed_ = true;
    socket_.plain.close();
  }

 private:
  struct Socket : AnyStream {
    Socket(const SerialExecutor& executor, asio::ssl::context* context);
    asio::any_io_executor get_executor() override { return plain.get_executor(); }
    void read_some(asio::mutable_buffer into, Handler handler) override;
    void write_some(const WriteBuffers& from, Handler handler) override;

    beast::tcp_stream plain;
    std::optional<asio::ssl::stream<beast::tcp_stream&>> tls;
  };

  Socket socket_;
  beast::flat_buffer buffer_;
  // connect() asks this after it has found addresses: no socket is open until then that close() could close.
  bool is_closed_ = false;
};

}  // namespace hairnet::server
