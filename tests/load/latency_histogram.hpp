#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace hairnet::load {

// A histogram of times with a logarithmic axis: 4096 bins from 1 us to 1000 s, each 0.51 % wide. The minimum, the
// maximum and the sum are exact. A time outside the axis counts in the bin at that end. Use it on one thread.
class LatencyHistogram {
 public:
  void record(std::int64_t time_ns, std::uint64_t count = 1);
  void merge(const LatencyHistogram& other);
  void clear();

  [[nodiscard]] std::uint64_t count() const { return count_; }
  // These are 0 when the histogram is empty.
  [[nodiscard]] double max_ms() const;
  [[nodiscard]] double min_ms() const;
  [[nodiscard]] double mean_ms() const;
  // Returns the smallest time that this share of all times do not exceed. It is exact to the width of a bin, and never
  // below the minimum or above the maximum.
  [[nodiscard]] double quantile_ms(double share) const;
  // Returns at most `points_max` pairs (time in ms, share of times above it) for a plot with a logarithmic axis of
  // shares. The times rise and the shares fall.
  [[nodiscard]] std::vector<std::pair<double, double>> tail(std::size_t points_max = 200) const;

 private:
  // It is empty until the first time is recorded.
  std::vector<std::uint64_t> bins_;
  std::uint64_t count_ = 0;
  std::int64_t min_ns_ = 0, max_ns_ = 0;
  double sum_ns_ = 0;
};

}  // namespace hairnet::load
