#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace hairnet::load {

// Times by a logarithmic axis: 4096 bins from 1 us to 1000 s, each 0.51 % wide; least, most and sum are exact. What
// lies outside counts in the bin at that end. One thread.
class LatencyHistogram {
 public:
  void record(std::int64_t time_ns, std::uint64_t count = 1);
  void merge(const LatencyHistogram& other);
  void clear();

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] double max_ms() const;  // 0 when empty; so are the others
  [[nodiscard]] double min_ms() const;
  [[nodiscard]] double mean_ms() const;
  // The least time that at least this share of all times do not exceed: within a bin's width, never beyond min and max.
  [[nodiscard]] double quantile_ms(double share) const;
  // (time in ms, share of times above it), falling, for a plot with a logarithmic tail: at most `points_max`.
  [[nodiscard]] std::vector<std::pair<double, double>> tail(std::size_t points_max = 200) const;

 private:
  std::vector<std::uint64_t> bins_;  // empty until the first time
  std::uint64_t count_ = 0;
  std::int64_t min_ns_ = 0, max_ns_ = 0;
  double sum_ns_ = 0;
};

}  // namespace hairnet::load
