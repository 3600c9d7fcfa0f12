#include "server/app/server_pages.hpp"

#include <utility>

#include "core/assert.hpp"
#include "server/app/process_gauges.hpp"
#include "server/telemetry/prometheus_text.hpp"

namespace hairnet::server {

ServerPages::ServerPages(Metrics& metrics, std::function<Health()> health, FleetPages fleet, HttpService& room)
    : metrics_(&metrics), health_(std::move(health)), fleet_(std::move(fleet)), room_(&room) {
  HAIRNET_ASSERT(health_);
}

HttpResponse ServerPages::handle(const HttpRequest& request) {
  const std::string_view path = request.path;
  // /healthz needs nothing of the server: a program that answers it lives. A restart would not help a server that is
  // only not ready.
  if (path == "/healthz") return {.body = "alive\n"};
  if (path == "/readyz") return ready_page();
  if (path == "/metrics") return metrics_page();
  if (path == "/fleet.json" && fleet_.json) return {.content_type = "application/json", .body = fleet_.json()};
  if (path == "/fleet" && fleet_.html) return {.content_type = "text/html; charset=utf-8", .body = fleet_.html()};
  // The other service answers 404 for what it does not know.
  return room_->handle(request);
}

HttpResponse ServerPages::ready_page() const {
  const std::string error = why_not_ready(health_());
  return error.empty() ? HttpResponse{.body = "ready\n"} : refusal(503, error);
}

HttpResponse ServerPages::metrics_page() {
  // The gauge is computed for the same moment as the page that shows it.
  metrics_->program.ready.set(why_not_ready(health_()).empty() ? 1 : 0);
  // The system is asked only when somebody reads the figures.
  read_process(metrics_->program);
  return {.content_type = kPrometheusContentType, .body = prometheus_text(*metrics_)};
}

}  // namespace hairnet::server
