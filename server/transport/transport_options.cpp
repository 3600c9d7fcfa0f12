#include "server/transport/transport_options.hpp"

#include "server/transport/asio.hpp"
#include "server/transport/origin.hpp"

namespace hairnet::server {
namespace {

std::string validate_addresses(const std::vector<std::string>& addresses) {
  for (const std::string& address : addresses) {
    boost::system::error_code error;
    asio::ip::make_address(address, error);
    if (error) return "\"" + address + "\" is not a numeric address";
  }
  return {};
}

}  // namespace

std::string validate(const TransportOptions& options) {
  if (options.addresses.empty()) return "no address to listen on";
  if (options.tls.certificate.empty() != options.tls.key.empty()) return "TLS needs both a certificate and its key";
  if (options.tls_required && options.tls.certificate.empty()) return "TLS is required, but there is no certificate";
  for (const std::string& origin : options.origins) {
    if (std::string wrong = validate_origin(origin); !wrong.empty()) return wrong;
  }
  for (const std::string& host : options.hosts) {
    if (std::string wrong = validate_host(host); !wrong.empty()) return wrong;
  }
  for (const auto* addresses : {&options.exempt_addresses, &options.proxy_protocol}) {
    if (std::string wrong = validate_addresses(*addresses); !wrong.empty()) return wrong;
  }
  return {};
}

}  // namespace hairnet::server
