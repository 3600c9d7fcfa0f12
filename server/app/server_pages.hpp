#pragma once

#include <functional>

#include "server/app/health.hpp"
#include "server/app/metrics.hpp"
#include "server/transport/http_service.hpp"

namespace hairnet::server {

// The server's own pages: /healthz (200 while the process lives), /readyz (200 or 503 and why) and /metrics.
// I/O thread; nothing blocks.
class ServerPages final : public HttpService {
 public:
  // Calls `health` at each request. `metrics` must outlive the pages.
  ServerPages(Metrics& metrics, std::function<Health()> health);

  HttpResponse handle(const HttpRequest& request) override;

 private:
  HttpResponse metrics_page();
  HttpResponse ready_page() const;

  Metrics* metrics_;
  std::function<Health()> health_;
};

}  // namespace hairnet::server
