#include "client/link/socket.hpp"

#include <netinet/tcp.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <sys/socket.h>

#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>
#include <utility>

namespace hairnet::link {
namespace {

using asio::ip::tcp;
using boost::system::error_code;

// The most unsent bytes that the kernel holds: a new pose waits behind all of them.
constexpr int kUnsentBytesMax = 64 << 10;
// The kernel alone would try for many minutes before it reports a peer that vanished.
constexpr unsigned kUnacknowledgedMax_ms = 15'000;

// Limits what the kernel may buffer, and how long it waits for a peer that vanished. The link also works without these
// options, but less well.
void tune(tcp::socket& socket) {
  error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytesMax, sizeof kUnsentBytesMax);
  setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnacknowledgedMax_ms,
             sizeof kUnacknowledgedMax_ms);
}

std::string name_of(const Address& address) {
  return address.host + ":" + std::to_string(address.port);
}

// Connects from the client's own address to the first of the server's addresses that is of the same kind.
asio::awaitable<void> connect_from(tcp::socket& socket, const asio::ip::address& local,
                                   const tcp::resolver::results_type& found, error_code& error) {
  error = asio::error::address_family_not_supported;
  for (const auto& entry : found) {
    if (entry.endpoint().address().is_v4() != local.is_v4()) continue;
    socket.open(entry.endpoint().protocol(), error);
    if (!error) {
      // The kernel chooses the port at connect(), where the whole connection must be unique. A port that is chosen at
      // bind() would be taken for the address: it then has ports for some 28 000 connections a minute only.
      const asio::detail::socket_option::boolean<IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT> port_later(true);
      error_code ignored;
      socket.set_option(port_later, ignored);
      socket.bind({local, 0}, error);
    }
    if (!error) co_await socket.async_connect(entry.endpoint(), asio::redirect_error(asio::use_awaitable, error));
    co_return;
  }
}

// Returns an empty string, or one line with the reason of the failure.
std::string configure(asio::ssl::context& context, const TlsOptions& options) {
  // TLS 1.0 and 1.1 are deprecated (RFC 8996).
  SSL_CTX_set_min_proto_version(context.native_handle(), TLS1_2_VERSION);
  error_code error;
  context.set_verify_mode(options.insecure ? asio::ssl::verify_none : asio::ssl::verify_peer, error);
  if (error) return "TLS cannot be set up: " + error.message();
  if (options.insecure) return {};
  if (options.ca_file.empty())
    context.set_default_verify_paths(error);
  else
    context.load_verify_file(options.ca_file, error);
  if (error) return "'" + options.ca_file + "' cannot be read as certificates: " + error.message();
  return {};
}

}  // namespace

Socket::Socket(asio::io_context& io, StreamOptions options)
    : options_(std::move(options)), socket_(io), lookup_(io.get_executor()) {}

asio::ip::address Socket::remote_address() const {
  error_code ignored;
  return socket_.remote_endpoint(ignored).address();
}

asio::awaitable<std::string> Socket::open() {
  if (!options_.server.encrypted()) co_return co_await connect();
  context_.emplace(asio::ssl::context::tls_client);
  std::string error = configure(*context_, options_.tls);
  if (error.empty()) error = co_await connect();
  if (error.empty()) error = co_await shake_hands();
  co_return error;
}

asio::awaitable<std::string> Socket::connect() {
  const Address& address = options_.server;
  error_code error;
  const NameLookup::Found found = co_await lookup_.find(address, error);
  if (error) co_return "cannot find " + name_of(address) + ": " + error.message();
  if (options_.local)
    co_await connect_from(socket_, *options_.local, found, error);
  else
    co_await asio::async_connect(socket_, found, asio::redirect_error(asio::use_awaitable, error));
  if (error)
    co_return "cannot connect to " + name_of(address) + ": " + error.message() + "; is hairnet-server running there?";
  tune(socket_);
  co_return std::string();
}

asio::awaitable<std::string> Socket::shake_hands() {
  tls_.emplace(socket_, *context_);
  const std::string& host = options_.server.host;
  error_code error, not_an_address;
  asio::ip::make_address(host, not_an_address);
  // TLS names no IP addresses to the server (RFC 6066, 3); the certificate is checked against one all the same.
  if (not_an_address) SSL_set_tlsext_host_name(tls_->native_handle(), host.c_str());
  if (!options_.tls.insecure) tls_->set_verify_callback(asio::ssl::host_name_verification(host), error);
  if (!error)
    co_await tls_->async_handshake(asio::ssl::stream_base::client, asio::redirect_error(asio::use_awaitable, error));
  if (!error) co_return std::string();
  // OpenSSL's own error says only that verification failed; the verdict says why.
  const long verdict = SSL_get_verify_result(tls_->native_handle());
  const std::string reason =
      verdict == X509_V_OK || options_.tls.insecure
          ? error.message()
          : std::string("its certificate is refused (") + X509_verify_cert_error_string(verdict) + ")";
  co_return "no TLS with " + to_string(options_.server) + ": " + reason;
}

void Socket::read_some(asio::mutable_buffer into, Handler handler) {
  if (tls_)
    tls_->async_read_some(into, std::move(handler));
  else
    socket_.async_read_some(into, std::move(handler));
}

void Socket::write_some(const WriteBuffers& from, Handler handler) {
  if (tls_)
    tls_->async_write_some(from, std::move(handler));
  else
    socket_.async_write_some(from, std::move(handler));
}

void Socket::half_close() {
  error_code ignored;
  socket_.shutdown(tcp::socket::shutdown_send, ignored);
}

void Socket::close() {
  lookup_.cancel();
  error_code ignored;
  socket_.close(ignored);
}

std::string Socket::describe(const error_code& error) const {
  // Many servers close without TLS's own end. A stream that somebody has cut shows all the same: it ends without the
  // protocol's goodbye.
  if (error == asio::error::eof || error == asio::ssl::error::stream_truncated)
    return "the server closed the connection without a goodbye";
  return "the connection to " + name_of(options_.server) + " broke: " + error.message();
}

}  // namespace hairnet::link
