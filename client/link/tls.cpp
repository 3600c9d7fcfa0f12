#include "client/link/tls.hpp"

#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>

#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>

namespace hairnet::link {
namespace {

using boost::system::error_code;

// The reason why the certificate was refused, if that was the failure.
std::string describe_handshake_failure(TlsSocket& socket, const error_code& error, const TlsOptions& options) {
  const long verdict = SSL_get_verify_result(socket.native_handle());
  if (verdict == X509_V_OK || options.insecure) return error.message();
  return std::string("its certificate is refused (") + X509_verify_cert_error_string(verdict) + ")";
}

}  // namespace

asio::ssl::context make_tls_context() {
  asio::ssl::context context(asio::ssl::context::tls_client);
  SSL_CTX_set_min_proto_version(context.native_handle(), TLS1_2_VERSION);
  return context;
}

std::string configure(asio::ssl::context& context, const TlsOptions& options) {
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

asio::awaitable<std::string> tls_handshake(TlsSocket& socket, const StreamOptions& options) {
  const Address& address = options.server;
  error_code error, not_an_address;
  asio::ip::make_address(address.host, not_an_address);
  if (not_an_address) SSL_set_tlsext_host_name(socket.native_handle(), address.host.c_str());
  if (!options.tls.insecure) socket.set_verify_callback(asio::ssl::host_name_verification(address.host), error);
  if (!error)
    co_await socket.async_handshake(asio::ssl::stream_base::client, asio::redirect_error(asio::use_awaitable, error));
  if (error)
    co_return "no TLS with " + to_string(address) + ": " + describe_handshake_failure(socket, error, options.tls);
  co_return std::string();
}

}  // namespace hairnet::link
