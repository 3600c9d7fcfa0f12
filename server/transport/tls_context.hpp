#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "server/transport/asio.hpp"
#include "server/transport/transport_options.hpp"

namespace hairnet::server {

// Makes the server side of TLS 1.2 and later. The error for unusable files is one line. An expired certificate only
// causes a warning, since a clock may be wrong. The files are read once.
Result<std::shared_ptr<asio::ssl::context>> make_tls_context(const TlsFiles& files);

// Makes the client side of TLS 1.2 and later. The server's certificate must follow from one in the file `ca`, or from
// the system's authorities when `ca` is empty. The caller has the name verified. `whose` is the server in words, for
// errors.
Result<std::shared_ptr<asio::ssl::context>> make_client_tls_context(const std::string& ca, std::string_view whose);

// Returns why OpenSSL could not read the PEM file; empty: it can. A pipe, which would block, counts as unreadable.
// OpenSSL's own messages about this are hard to read.
std::string unreadable_pem(const std::string& path);

// The newest error of OpenSSL in words, which is then forgotten.
std::string openssl_reason();

}  // namespace hairnet::server
