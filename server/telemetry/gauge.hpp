#pragma once

#include <atomic>
#include <cmath>
#include <limits>
#include <string_view>
#include <vector>

#include "core/assert.hpp"
#include "server/telemetry/metric_name.hpp"

namespace hairnet::server {

class Gauge;

// The gauges of one part of the server, as members that enter themselves in its list.
class GaugeSet {
 public:
  GaugeSet() = default;
  GaugeSet(const GaugeSet&) = delete;
  GaugeSet& operator=(const GaugeSet&) = delete;
  [[nodiscard]] const std::vector<const Gauge*>& gauges() const { return gauges_; }

 private:
  friend class Gauge;
  std::vector<const Gauge*> gauges_;
};

// A current value. NaN until it is first set; /metrics leaves such gauges out. Any thread; relaxed memory order.
class Gauge {
 public:
  Gauge(GaugeSet& set, std::string_view family, std::string_view help) : Gauge(set, family, {}, {}, help) {}
  Gauge(GaugeSet& set, std::string_view family, std::string_view label, std::string_view value,
        std::string_view help = {})
      : name_{family, label, value, help} {
    HAIRNET_ASSERT(name_.is_valid());
    set.gauges_.push_back(this);
  }
  Gauge(const Gauge&) = delete;
  Gauge& operator=(const Gauge&) = delete;

  void set(double value) { value_.store(value, std::memory_order_relaxed); }
  [[nodiscard]] double value() const { return value_.load(std::memory_order_relaxed); }
  // A gauge of a part that this server does not use, as an object store, is never set.
  [[nodiscard]] bool is_set() const { return !std::isnan(value()); }
  [[nodiscard]] const MetricName& name() const { return name_; }

 private:
  MetricName name_;
  std::atomic<double> value_{std::numeric_limits<double>::quiet_NaN()};
};

}  // namespace hairnet::server
