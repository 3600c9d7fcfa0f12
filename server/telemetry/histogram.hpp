#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <string_view>
#include <vector>

#include "core/assert.hpp"
#include "server/telemetry/metric_name.hpp"

namespace hairnet::server {

class Histogram;

// The histograms of one part of the server, as members that enter themselves in its list.
class HistogramSet {
 public:
  HistogramSet() = default;
  HistogramSet(const HistogramSet&) = delete;
  HistogramSet& operator=(const HistogramSet&) = delete;
  [[nodiscard]] const std::vector<const Histogram*>& histograms() const { return histograms_; }

 private:
  friend class Histogram;
  std::vector<const Histogram*> histograms_;
};

// Counts values in fixed buckets. Any thread, without a lock, so that the tick may use it (prometheus::Histogram takes
// a mutex). Ignores values that are not finite: one of them would make the sum useless.
class Histogram {
 public:
  // Arrays of a fixed size need no allocation.
  static constexpr std::size_t kBoundsMax = 20;
  // The bucket after the last bound has no upper one.
  using Counts = std::array<std::uint64_t, kBoundsMax + 1>;

  // Values of one thread, collected without atomics and added together at the end.
  class Tally {
   public:
    explicit Tally(Histogram& to) : to_(&to) {}
    Tally(const Tally&) = delete;
    Tally& operator=(const Tally&) = delete;
    ~Tally() { to_->add(counts_, sum_); }
    void observe(double value) {
      if (!std::isfinite(value)) return;
      ++counts_[to_->bucket(value)];
      sum_ += value;
    }

   private:
    Histogram* to_;
    Counts counts_{};
    double sum_ = 0;
  };

  // `bounds` are ascending; each is the highest value of its bucket.
  Histogram(HistogramSet& set, std::string_view family, std::string_view help, std::initializer_list<double> bounds)
      : name_{.family = family, .help = help} {
    HAIRNET_ASSERT(name_.is_valid());
    HAIRNET_ASSERT(bounds.size() > 0);
    HAIRNET_ASSERT(bounds.size() <= kBoundsMax);
    for (const double bound : bounds) {
      HAIRNET_ASSERT(bound_count_ == 0 || bound > bounds_[bound_count_ - 1]);
      bounds_[bound_count_++] = bound;
    }
    set.histograms_.push_back(this);
  }
  Histogram(const Histogram&) = delete;
  Histogram& operator=(const Histogram&) = delete;

  void observe(double value) {
    if (!std::isfinite(value)) return;
    counts_[bucket(value)].fetch_add(1, std::memory_order_relaxed);
    sum_.fetch_add(value, std::memory_order_relaxed);
  }

  [[nodiscard]] const MetricName& name() const { return name_; }
  [[nodiscard]] std::size_t bound_count() const { return bound_count_; }
  [[nodiscard]] double bound(std::size_t i) const {
    HAIRNET_ASSERT(i < bound_count_);
    return bounds_[i];
  }
  // Count of bucket i alone, without the buckets below; i = bound_count() is the bucket above every bound.
  [[nodiscard]] std::uint64_t count(std::size_t i) const {
    HAIRNET_ASSERT(i <= bound_count_);
    return counts_[i].load(std::memory_order_relaxed);
  }
  [[nodiscard]] double sum() const { return sum_.load(std::memory_order_relaxed); }

 private:
  [[nodiscard]] std::size_t bucket(double value) const {
    // There are at most 20 bounds, so a plain search is short.
    std::size_t i = 0;
    while (i < bound_count_ && value > bounds_[i]) ++i;
    return i;
  }
  void add(const Counts& counts, double sum) {
    for (std::size_t i = 0; i <= bound_count_; ++i) {
      // Most buckets of a tally are empty, and an atomic addition costs more than the test.
      if (counts[i] != 0) counts_[i].fetch_add(counts[i], std::memory_order_relaxed);
    }
    sum_.fetch_add(sum, std::memory_order_relaxed);
  }

  MetricName name_;
  std::array<double, kBoundsMax> bounds_{};
  std::size_t bound_count_ = 0;
  std::array<std::atomic<std::uint64_t>, kBoundsMax + 1> counts_{};
  std::atomic<double> sum_{0};
};

}  // namespace hairnet::server
