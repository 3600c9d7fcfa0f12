#pragma once

#include <atomic>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/assert.hpp"
#include "server/telemetry/metric_name.hpp"

namespace hairnet::server {

class Counter;

// The counters of one part of the server, as members that enter themselves in its list. The list has the addresses of
// the members, so a set can be neither copied nor moved.
class CounterSet {
 public:
  CounterSet() = default;
  CounterSet(const CounterSet&) = delete;
  CounterSet& operator=(const CounterSet&) = delete;
  [[nodiscard]] const std::vector<const Counter*>& counters() const { return counters_; }

 private:
  friend class Counter;
  std::vector<const Counter*> counters_;
};

// A total that any thread may add to. Relaxed memory order. Readers see each total soon and exactly, but not several
// totals of the same moment.
class Counter {
 public:
  Counter(CounterSet& set, std::string_view family, std::string_view help, double scale = 1)
      : Counter(set, family, {}, {}, help, scale) {}
  Counter(CounterSet& set, std::string_view family, std::string_view label, std::string_view value,
          std::string_view help = {}, double scale = 1)
      : name_{family, label, value, help, scale} {
    HAIRNET_ASSERT(name_.is_valid());
    set.counters_.push_back(this);
  }
  Counter(const Counter&) = delete;
  Counter& operator=(const Counter&) = delete;

  void add(std::uint64_t n = 1) { value_.fetch_add(n, std::memory_order_relaxed); }
  // Makes the counter a maximum instead of a total. One thread: two could undo each other.
  void raise_to(std::uint64_t n) {
    if (n > value()) value_.store(n, std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t value() const { return value_.load(std::memory_order_relaxed); }
  // The value in the unit that is shown.
  [[nodiscard]] double scaled_value() const { return static_cast<double>(value()) * name_.scale; }
  [[nodiscard]] const MetricName& name() const { return name_; }

 private:
  MetricName name_;
  std::atomic<std::uint64_t> value_{0};
};

}  // namespace hairnet::server
