#include "server/app/metrics.hpp"

#include <fmt/format.h>

#include "server/telemetry/prometheus_text.hpp"

namespace hairnet::server {

std::string prometheus_text(const Metrics& metrics) {
  return prometheus_text(metrics.counter_sets(), metrics.gauge_sets(), metrics.histogram_sets());
}

std::string to_text(const Metrics& metrics, char between, char after) {
  std::string text;
  const auto add = [&](const CounterSet& set) {
    for (const Counter* counter : set.counters()) {
      if (counter->value() == 0) continue;
      text += fmt::format("{}{}{:.15g}{}", counter->name().flat(), between, counter->scaled_value(), after);
    }
  };
  for (const CounterSet* set : metrics.counter_sets()) add(*set);
  add(metrics.tick.log_only);
  return text;
}

}  // namespace hairnet::server
