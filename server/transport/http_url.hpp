#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hairnet::server {

// Where a client of HTTP connects to.
struct HttpUrl {
  // A name or a numeric address, without brackets.
  std::string host;
  // Zero stands for the scheme's port.
  std::uint16_t port = 0;
  bool is_tls = false;
  // Begins at the first slash after the host; is not parsed, and may be empty.
  std::string path;
};

// http://host[:port][/path] or https://...; nothing when it is not that.
std::optional<HttpUrl> parse_http_url(std::string_view url);

}  // namespace hairnet::server
