#pragma once

#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <string>

#include "client/link/socket.hpp"

namespace hairnet::link {

using TlsSocket = asio::ssl::stream<asio::ip::tcp::socket>;

asio::ssl::context make_tls_context();

// Applies `options` to the context. Returns an empty string, or one line with the reason of the failure.
std::string configure(asio::ssl::context& context, const TlsOptions& options);

// Shakes hands over a connected socket: names the host to the server and checks the server's certificate. Returns an
// empty string, or one line with the reason of the failure.
asio::awaitable<std::string> tls_handshake(TlsSocket& socket, const StreamOptions& options);

}  // namespace hairnet::link
