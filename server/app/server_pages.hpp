#pragma once

#include <functional>
#include <string>

#include "server/app/health.hpp"
#include "server/app/metrics.hpp"
#include "server/transport/http_service.hpp"

namespace hairnet::server {

// What shows the fleet to programs and to people.
struct FleetPages {
  std::function<std::string()> json, html;
};

// The server's own pages: /healthz (200 while the process lives), /readyz (200 or 503 and why), /metrics, and
// on a service port /fleet and /fleet.json (all servers of the fleet, and who has which room: names of rooms are not
// for everyone). /room is another service's. I/O thread; nothing blocks.
class ServerPages final : public HttpService {
 public:
  // Calls `health` and `fleet` at a request; `fleet` is empty where the public can ask. `metrics` and `room` must
  // outlive the pages.
  ServerPages(Metrics& metrics, std::function<Health()> health, FleetPages fleet, HttpService& room);

  HttpResponse handle(const HttpRequest& request) override;

 private:
  HttpResponse metrics_page();
  HttpResponse ready_page() const;

  Metrics* metrics_;
  std::function<Health()> health_;
  FleetPages fleet_;
  HttpService* room_;
};

}  // namespace hairnet::server
