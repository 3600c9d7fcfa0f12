#include "server/app/prometheus_text.hpp"

#include <prometheus/text_serializer.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "server/telemetry/metric_name.hpp"

namespace hairnet::server {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

// Not exported: the tick_seconds histogram shows the same.
constexpr std::array<std::string_view, 2> kNotExported{"tick_ns_total", "tick_ns_max"};

ClientMetric::Histogram contents(const Histogram& histogram) {
  ClientMetric::Histogram contents;
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < histogram.bound_count(); ++i) {
    below += histogram.count(i);
    contents.bucket.push_back({below, histogram.bound(i)});
  }
  contents.sample_count = below + histogram.count(histogram.bound_count());
  contents.bucket.push_back({contents.sample_count, std::numeric_limits<double>::infinity()});
  contents.sample_sum = histogram.sum();
  return contents;
}

class Families {
 public:
  void add(const CounterSet& set) {
    for (const Counter* counter : set.counters()) {
      if (std::find(kNotExported.begin(), kNotExported.end(), counter->name()) != kNotExported.end()) continue;
      const MetricName name = metric_name(counter->name(), MetricKind::counter);
      add(name, MetricType::Counter).counter.value = static_cast<double>(counter->value()) * name.scale;
    }
  }
  void add(const GaugeSet& set) {
    for (const Gauge* gauge : set.gauges()) {
      if (gauge->is_set())
        add(metric_name(gauge->name(), MetricKind::gauge), MetricType::Gauge).gauge.value = gauge->value();
    }
  }
  void add(const HistogramSet& set) {
    for (const Histogram* histogram : set.histograms())
      add(metric_name(histogram->name(), MetricKind::histogram), MetricType::Histogram).histogram =
          contents(*histogram);
  }
  [[nodiscard]] std::vector<MetricFamily> take() {
    std::vector<MetricFamily> families;
    for (auto& [name, family] : families_) families.push_back(std::move(family));
    return families;
  }

 private:
  ClientMetric& add(const MetricName& name, MetricType type) {
    MetricFamily& family = families_[name.family];
    family.name = name.family;
    family.type = type;
    ClientMetric& metric = family.metric.emplace_back();
    if (!name.label_name.empty()) metric.label.push_back({name.label_name, name.label_value});
    return metric;
  }
  std::map<std::string, MetricFamily> families_;
};

MetricFamily build_info() {
  ClientMetric metric;
  metric.label.push_back({"version", HAIRNET_VERSION});
  metric.gauge.value = 1;
  return {"hairnet_build_info", "", MetricType::Gauge, {metric}};
}

}  // namespace

std::string prometheus_text(const Metrics& metrics) {
  Families families;
  for (const CounterSet* set : metrics.counter_sets()) families.add(*set);
  for (const GaugeSet* set : metrics.gauge_sets()) families.add(*set);
  for (const HistogramSet* set : metrics.histogram_sets()) families.add(*set);
  std::vector<MetricFamily> all = families.take();
  all.push_back(build_info());
  return prometheus::TextSerializer().Serialize(all);
}

}  // namespace hairnet::server
