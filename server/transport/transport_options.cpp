#include "server/transport/transport_options.hpp"

#include "server/transport/origin.hpp"

namespace hairnet::server {

std::string validate(const TransportOptions& options) {
  if (options.addresses.empty()) return "no address to listen on";
  if (options.tls.certificate.empty() != options.tls.key.empty()) return "TLS needs both a certificate and its key";
  if (options.tls_required && options.tls.certificate.empty()) return "TLS is required, but there is no certificate";
  for (const std::string& origin : options.origins) {
    if (std::string wrong = validate_origin(origin); !wrong.empty()) return wrong;
  }
  return {};
}

}  // namespace hairnet::server
