#include "server/transport/etcd_endpoint.hpp"

#include "server/transport/http_url.hpp"

namespace hairnet::server {
namespace {

constexpr std::uint16_t kEtcdPort = 2379;

}  // namespace

Result<EtcdEndpoint> parse_etcd_endpoint(std::string_view url) {
  const std::optional<HttpUrl> parsed = parse_http_url(url);
  // The paths are etcd's own; a path in the setting would be lost in silence.
  if (!parsed || !(parsed->path.empty() || parsed->path == "/"))
    return Refusal("\"" + std::string(url) + "\" is not an endpoint of etcd, as http://host:2379 or https://host:2379");
  return EtcdEndpoint{parsed->host, parsed->port == 0 ? kEtcdPort : parsed->port, parsed->is_tls};
}

std::string validate(const EtcdOptions& options) {
  if (options.endpoints.size() > EtcdOptions::kEndpointsMax)
    return "at most " + std::to_string(EtcdOptions::kEndpointsMax) + " endpoints of etcd";
  for (const std::string& url : options.endpoints)
    if (const auto endpoint = parse_etcd_endpoint(url); !endpoint) return endpoint.error();
  if (options.certificate.empty() != options.key.empty())
    return "a certificate for etcd needs its key, and a key its certificate";
  if (options.user.empty() != options.password_file.empty())
    return "a user of etcd needs a password file, and a password file its user";
  return {};
}

}  // namespace hairnet::server
