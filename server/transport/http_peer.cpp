#include "server/transport/http_peer.hpp"

#include <netinet/tcp.h>
#include <openssl/ssl.h>

#include <utility>

namespace hairnet::server {
namespace {

using Error = boost::system::error_code;
using Tcp = asio::ip::tcp;

// A connection whose peer has vanished is given up after about this many seconds: a watch would wait much longer.
constexpr int kSilence_s = 8;

void detect_silence(Tcp::socket& socket) {
  Error ignored;
  socket.set_option(Tcp::no_delay(true), ignored);
  // Probes find a dead peer while nothing is sent. TCP_USER_TIMEOUT finds one that does not acknowledge what was sent.
  socket.set_option(asio::socket_base::keep_alive(true), ignored);
  using Option = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPIDLE>;
  using Interval = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPINTVL>;
  using Timeout = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_USER_TIMEOUT>;
  socket.set_option(Option(kSilence_s / 2), ignored);
  socket.set_option(Interval(kSilence_s / 4), ignored);
  socket.set_option(Timeout(kSilence_s * 1000), ignored);
}

}  // namespace

HttpPeer::Socket::Socket(const SerialExecutor& executor, asio::ssl::context* context) : plain(executor) {
  if (context) tls.emplace(plain, *context);
}

// The executor is bound because Beast 1.81 cannot post to the one that a Handler names.
void HttpPeer::Socket::read_some(asio::mutable_buffer into, Handler handler) {
  auto bound = asio::bind_executor(get_executor(), std::move(handler));
  if (tls)
    tls->async_read_some(into, std::move(bound));
  else
    plain.async_read_some(into, std::move(bound));
}

void HttpPeer::Socket::write_some(const WriteBuffers& from, Handler handler) {
  auto bound = asio::bind_executor(get_executor(), std::move(handler));
  if (tls)
    tls->async_write_some(from, std::move(bound));
  else
    plain.async_write_some(from, std::move(bound));
}

asio::awaitable<Error> HttpPeer::connect(const std::string& host, std::uint16_t port,
                                         std::chrono::milliseconds timeout) {
  Tcp::resolver resolver(socket_.get_executor());
  const auto [unresolved, addresses] = co_await resolver.async_resolve(host, std::to_string(port), kAwaitable);
  if (unresolved) co_return unresolved;
  if (is_closed_) co_return asio::error::operation_aborted;
  socket_.plain.expires_after(timeout);
  const auto [unconnected, address] = co_await socket_.plain.async_connect(addresses, kAwaitable);
  if (unconnected) co_return unconnected;
  detect_silence(socket_.plain.socket());
  if (!socket_.tls) co_return Error();
  Error wrong;
  // The server may have several certificates, and chooses by this name (SNI), which must not be an address (RFC 6066).
  // An error means that the host is a name and not an address.
  if (asio::ip::make_address(host, wrong); wrong) SSL_set_tlsext_host_name(socket_.tls->native_handle(), host.c_str());
  socket_.tls->set_verify_mode(asio::ssl::verify_peer);
  // Without this callback any certificate of a known authority would pass, also one of another host.
  socket_.tls->set_verify_callback(asio::ssl::host_name_verification(host));
  const auto [refused] = co_await socket_.tls->async_handshake(asio::ssl::stream_base::client, kAwaitable);
  co_return refused;
}

}  // namespace hairnet::server
