#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hairnet::server {

// Where a client of HTTP connects to.
struct HttpUrl {
  std::string host;        // a name or a numeric address, without brackets
  std::uint16_t port = 0;  // 0: that of the scheme
  bool is_tls = false;
  std::string path;  // from the first slash after the host, unread; may be empty
};

// http://host[:port][/path] or https://...; nothing when it is not that.
std::optional<HttpUrl> parse_http_url(std::string_view url);

}  // namespace hairnet::server
