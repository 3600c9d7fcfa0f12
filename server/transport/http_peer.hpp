#pragma once

#include <netinet/tcp.h>
#include <openssl/ssl.h>

#include <chrono>
#include <optional>
#include <string>
#include <tuple>

#include "server/transport/asio.hpp"
#include "server/transport/beast.hpp"

namespace hairnet::server {

// One connection to a server of HTTP/1.1, plain or inside TLS.
class HttpPeer {
 public:
  using Error = boost::system::error_code;
  using Tcp = asio::ip::tcp;

  // `buffer_bytes_max`: what is read and not yet parsed. `tls` may be null, and must outlive the peer.
  HttpPeer(const SerialExecutor& executor, asio::ssl::context* tls, std::size_t buffer_bytes_max)
      : plain_(executor), buffer_(buffer_bytes_max) {
    if (tls) tls_.emplace(plain_, *tls);
  }

  // `timeout` is for all of it but finding the addresses of a name.
  asio::awaitable<Error> connect(const std::string& host, std::uint16_t port, std::chrono::milliseconds timeout) {
    Tcp::resolver resolver(plain_.get_executor());
    const auto [unresolved, addresses] = co_await resolver.async_resolve(host, std::to_string(port), kAwaitable);
    if (unresolved) co_return unresolved;
    if (is_closed_) co_return asio::error::operation_aborted;
    plain_.expires_after(timeout);
    const auto [unconnected, address] = co_await plain_.async_connect(addresses, kAwaitable);
    if (unconnected) co_return unconnected;
    detect_silence();
    if (!tls_) co_return Error();
    Error wrong;
    if (asio::ip::make_address(host, wrong); wrong)  // a name, not a number
      SSL_set_tlsext_host_name(tls_->native_handle(), host.c_str());
    tls_->set_verify_mode(asio::ssl::verify_peer);
    tls_->set_verify_callback(asio::ssl::host_name_verification(host));
    const auto [refused] = co_await tls_->async_handshake(asio::ssl::stream_base::client, kAwaitable);
    co_return refused;
  }

  template <class Message>
  asio::awaitable<Error> write(const Message& message) {
    if (!tls_) co_return std::get<0>(co_await http::async_write(plain_, message, kAwaitable));
    co_return std::get<0>(co_await http::async_write(*tls_, message, kAwaitable));
  }
  template <class Parser>
  asio::awaitable<Error> read_header(Parser& parser) {
    if (!tls_) co_return std::get<0>(co_await http::async_read_header(plain_, buffer_, parser, kAwaitable));
    co_return std::get<0>(co_await http::async_read_header(*tls_, buffer_, parser, kAwaitable));
  }
  template <class Parser>
  asio::awaitable<Error> read(Parser& parser) {
    if (!tls_) co_return std::get<0>(co_await http::async_read(plain_, buffer_, parser, kAwaitable));
    co_return std::get<0>(co_await http::async_read(*tls_, buffer_, parser, kAwaitable));
  }
  template <class Parser>
  asio::awaitable<Error> read_some(Parser& parser) {
    if (!tls_) co_return std::get<0>(co_await http::async_read_some(plain_, buffer_, parser, kAwaitable));
    co_return std::get<0>(co_await http::async_read_some(*tls_, buffer_, parser, kAwaitable));
  }
  // Of the operations that follow.
  void expires_after(std::chrono::milliseconds time) { plain_.expires_after(time); }
  void expires_never() { plain_.expires_never(); }
  void close() {
    is_closed_ = true;
    plain_.close();
  }

 private:
  // A connection whose peer has vanished is given up after about this many seconds: a watch would wait much longer.
  static constexpr int kSilence_s = 8;

  void detect_silence() {
    auto& socket = plain_.socket();
    Error ignored;
    socket.set_option(Tcp::no_delay(true), ignored);
    socket.set_option(asio::socket_base::keep_alive(true), ignored);
    using Option = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPIDLE>;
    using Interval = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPINTVL>;
    using Timeout = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_USER_TIMEOUT>;
    socket.set_option(Option(kSilence_s / 2), ignored);
    socket.set_option(Interval(kSilence_s / 4), ignored);
    socket.set_option(Timeout(kSilence_s * 1000), ignored);
  }

  beast::tcp_stream plain_;
  std::optional<asio::ssl::stream<beast::tcp_stream&>> tls_;
  beast::flat_buffer buffer_;
  bool is_closed_ = false;
};

}  // namespace hairnet::server
