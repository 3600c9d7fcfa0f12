#pragma once

#include <memory>

#include "core/result.hpp"
#include "server/transport/asio.hpp"
#include "server/transport/transport_options.hpp"

namespace hairnet::server {

// The server's side of TLS 1.2 and later. One line that says what is wrong with the files; a certificate that is out of
// date is only warned of, since some clock may be wrong. The files are read once.
Result<std::shared_ptr<asio::ssl::context>> make_tls_context(const TlsFiles& files);

}  // namespace hairnet::server
