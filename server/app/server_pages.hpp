#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "server/app/health.hpp"
#include "server/app/metrics.hpp"

namespace hairnet::server {

// The server's own pages: /healthz (200 while the process lives), /readyz (200 or 503 and why) and /metrics.
// I/O thread; nothing blocks.
class ServerPages {
 public:
  struct Page {
    int status = 200;
    std::string content_type = "text/plain; charset=utf-8";
    std::string body;
  };

  // `health` is asked at each request. `metrics` must outlive the pages.
  ServerPages(Metrics& metrics, std::function<Health()> health);

  Page page(std::string_view path);

 private:
  Page metrics_page();
  Page ready_page() const;

  Metrics* metrics_;
  std::function<Health()> health_;
};

}  // namespace hairnet::server
