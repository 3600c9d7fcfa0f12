#include "server/telemetry/prometheus_text.hpp"

#include <prometheus/text_serializer.h>

#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "core/assert.hpp"
#include "core/version.hpp"

namespace hairnet::server {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

// Converts a histogram into Prometheus' own form.
ClientMetric::Histogram contents(const Histogram& histogram) {
  ClientMetric::Histogram contents;
  // Ours count each bucket alone; Prometheus wants the sum of all buckets up to it.
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

// Prometheus wants all members of a family together, with the help once; ours are declared in any order.
class Families {
 public:
  void add(const CounterSet& set) {
    for (const Counter* counter : set.counters())
      add(counter->name(), "_total", MetricType::Counter).counter.value = counter->scaled_value();
  }
  void add(const GaugeSet& set) {
    for (const Gauge* gauge : set.gauges()) {
      // A gauge that is not set may still have its family's help.
      note_help(gauge->name(), "");
      if (gauge->is_set()) add(gauge->name(), "", MetricType::Gauge).gauge.value = gauge->value();
    }
  }
  void add(const HistogramSet& set) {
    for (const Histogram* histogram : set.histograms())
      add(histogram->name(), "", MetricType::Histogram).histogram = contents(*histogram);
  }
  [[nodiscard]] std::vector<MetricFamily> take() {
    std::vector<MetricFamily> families;
    for (auto& [name, family] : families_) {
      family.help = helps_[name];
      families.push_back(std::move(family));
    }
    return families;
  }

 private:
  static std::string shown_name(const MetricName& name, const char* suffix) {
    return "hairnet_" + std::string(name.family) + suffix;
  }
  void note_help(const MetricName& name, const char* suffix) {
    if (!name.help.empty()) helps_[shown_name(name, suffix)] = name.help;
  }
  ClientMetric& add(const MetricName& name, const char* suffix, MetricType type) {
    const std::string shown = shown_name(name, suffix);
    MetricFamily& family = families_[shown];
    // All metrics of a family are of one kind.
    HAIRNET_ASSERT(family.metric.empty() || family.type == type);
    family.name = shown;
    family.type = type;
    note_help(name, suffix);
    ClientMetric& metric = family.metric.emplace_back();
    if (!name.label.empty()) metric.label.push_back({std::string(name.label), std::string(name.value)});
    return metric;
  }
  // The families, sorted by their shown names, so that two looks at /metrics can be compared.
  std::map<std::string, MetricFamily> families_;
  // Any member may have the family's help, so helps are gathered apart.
  std::map<std::string, std::string> helps_;
};

// A gauge that is always 1 is Prometheus' way to show text, here the version.
MetricFamily build_info() {
  ClientMetric metric;
  metric.label.push_back({"version", kVersion});
  metric.gauge.value = 1;
  return {"hairnet_build_info", "1, with the version of the server.", MetricType::Gauge, {metric}};
}

}  // namespace

std::string prometheus_text(std::span<const CounterSet* const> counters, std::span<const GaugeSet* const> gauges,
                            std::span<const HistogramSet* const> histograms) {
  Families families;
  for (const CounterSet* set : counters) families.add(*set);
  for (const GaugeSet* set : gauges) families.add(*set);
  for (const HistogramSet* set : histograms) families.add(*set);
  std::vector<MetricFamily> all = families.take();
  all.push_back(build_info());
  return prometheus::TextSerializer().Serialize(all);
}

}  // namespace hairnet::server
