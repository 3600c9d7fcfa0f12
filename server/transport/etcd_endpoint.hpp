#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace hairnet::server {

// Where etcd is, and how this server shows who it is.
struct EtcdOptions {
  static constexpr std::size_t kEndpointsMax = 8;

  // Each is http://host[:port] or https://host[:port]; the port is 2379 by default.
  std::vector<std::string> endpoints;
  // Endpoints' certificates must follow from this PEM file; empty: from the system's.
  std::string ca;
  // The PEM files by which this server shows itself to etcd as a TLS client; both or none.
  std::string certificate, key;
  // One of etcd's own users, and the file whose first line is the password; both or none.
  std::string user, password_file;
};

struct EtcdEndpoint {
  // A name or a numeric address, without brackets.
  std::string host;
  std::uint16_t port = 2379;
  bool is_tls = false;
};

Result<EtcdEndpoint> parse_etcd_endpoint(std::string_view url);

// Returns an empty string when the options agree with each other; else one line. Reads no file.
std::string validate(const EtcdOptions& options);

}  // namespace hairnet::server
