#pragma once

#include <string_view>

#include "server/transport/http_response.hpp"

namespace hairnet::server {

// A request for one of the server's own pages. The string views are valid during the call only.
struct HttpRequest {
  std::string_view method;              // GET or HEAD; answer both alike: the transport drops the body of HEAD
  std::string_view path;                // /healthz, /readyz, /metrics, /fleet, /fleet.json or /room
  std::string_view query;               // behind '?', not decoded
  std::string_view peer;                // address:port
  std::string_view authorization = {};  // the header field
};

// The app's answers to these paths. I/O thread; must not block or throw.
class HttpService {
 public:
  virtual ~HttpService() = default;
  virtual HttpResponse handle(const HttpRequest& request) = 0;
};

}  // namespace hairnet::server
