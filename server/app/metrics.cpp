#include "server/app/metrics.hpp"

#include <fmt/format.h>

namespace hairnet::server {

std::string to_text(const Metrics& metrics, char between, char after) {
  std::string text;
  for (const CounterSet* set : metrics.counter_sets()) {
    for (const Counter* counter : set->counters()) {
      if (counter->value() != 0) text += fmt::format("{}{}{}{}", counter->name(), between, counter->value(), after);
    }
  }
  return text;
}

}  // namespace hairnet::server
