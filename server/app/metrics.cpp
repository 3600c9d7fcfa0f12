#include "server/app/metrics.hpp"

#include <fmt/format.h>

namespace hairnet::server {

std::string to_text(const Metrics& metrics) {
  std::string text;
  for (const CounterSet* set : std::initializer_list<const CounterSet*>{
           &metrics.transport, &metrics.session, &metrics.room, &metrics.tick, &metrics.groom, &metrics.level_cache}) {
    for (const Counter* counter : set->counters()) {
      if (counter->value() != 0) text += fmt::format("{} {}\n", counter->name(), counter->value());
    }
  }
  return text;
}

}  // namespace hairnet::server
