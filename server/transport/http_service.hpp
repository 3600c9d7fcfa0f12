#pragma once

#include <string_view>

#include "server/transport/http_response.hpp"

namespace hairnet::server {

// A request for one of the server's own pages. The string views are valid during the call only.
struct HttpRequest {
  // GET or HEAD. Answer both alike: the transport drops the body of HEAD.
  std::string_view method;
  // One of /healthz, /readyz, /metrics, /fleet, /fleet.json and /room.
  std::string_view path;
  // The part behind '?', not decoded.
  std::string_view query;
  // The peer's address:port, for the log.
  std::string_view peer;
  // The value of the header field Authorization; empty: there is none.
  std::string_view authorization = {};
};

// The app's answers to these paths. I/O thread; must not block or throw.
class HttpService {
 public:
  virtual ~HttpService() = default;
  virtual HttpResponse handle(const HttpRequest& request) = 0;
};

}  // namespace hairnet::server
