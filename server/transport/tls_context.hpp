#pragma once

#include <memory>

#include "core/result.hpp"
#include "server/transport/asio.hpp"
#include "server/transport/transport_options.hpp"

namespace hairnet::server {

// The server side of TLS 1.2 and later. The error for unusable files is one line. An expired certificate only causes a
// warning, since a clock may be wrong. The files are read once.
Result<std::shared_ptr<asio::ssl::context>> make_tls_context(const TlsFiles& files);

}  // namespace hairnet::server
