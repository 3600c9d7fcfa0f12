#pragma once

#include <string>

#include "server/app/metrics.hpp"

namespace hairnet::server {

// The body of /metrics: Prometheus' text format 0.0.4. Any thread.
std::string prometheus_text(const Metrics& metrics);

inline constexpr const char* kPrometheusContentType = "text/plain; version=0.0.4; charset=utf-8";

}  // namespace hairnet::server
