#pragma once

#include <string>
#include <string_view>

namespace hairnet::server {

// The Prometheus name of one of our counters, gauges or histograms: `poses_rejected_stale` is
// hairnet_poses_rejected_total{reason="stale"}.
struct MetricName {
  std::string family;
  std::string label_name, label_value;  // empty: none
  double scale = 1;                     // /metrics shows our value times this: Prometheus counts in seconds
};
enum class MetricKind { counter, gauge, histogram };

MetricName metric_name(std::string_view name, MetricKind kind);

}  // namespace hairnet::server
