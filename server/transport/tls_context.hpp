#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "server/transport/asio.hpp"
#include "server/transport/transport_options.hpp"

namespace hairnet::server {

// The server side of TLS 1.2 and later. The error for unusable files is one line. An expired certificate only causes a
// warning, since a clock may be wrong. The files are read once.
Result<std::shared_ptr<asio::ssl::context>> make_tls_context(const TlsFiles& files);

// The client side of it. The server's certificate must follow from one of the file `ca`, or of the system's when `ca`
// is empty; the caller has names verified. `whose`: the server, in words for errors.
Result<std::shared_ptr<asio::ssl::context>> make_client_tls_context(const std::string& ca, std::string_view whose);

// Why OpenSSL could not read the PEM file, which also could be a pipe that blocks; empty: it can. OpenSSL's own
// messages about this are hard to read.
std::string unreadable_pem(const std::string& path);

// The newest error of OpenSSL in words, which is then forgotten.
std::string openssl_reason();

}  // namespace hairnet::server
