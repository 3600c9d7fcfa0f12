#pragma once

#include <span>
#include <string>

#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"
#include "server/telemetry/histogram.hpp"

namespace hairnet::server {

// The body of /metrics: Prometheus' text format 0.0.4. Any thread.
std::string prometheus_text(std::span<const CounterSet* const> counters, std::span<const GaugeSet* const> gauges,
                            std::span<const HistogramSet* const> histograms);

inline constexpr const char* kPrometheusContentType = "text/plain; version=0.0.4; charset=utf-8";

}  // namespace hairnet::server
