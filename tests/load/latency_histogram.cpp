#include "tests/load/latency_histogram.hpp"

#include <algorithm>
#include <boost/histogram/axis/regular.hpp>
#include <cmath>

namespace hairnet::load {
namespace {

constexpr int kBins = 4096;
constexpr double kLeast_ns = 1e3, kMost_ns = 1e12;

using Axis = boost::histogram::axis::regular<double, boost::histogram::axis::transform::log,
                                             boost::histogram::axis::null_type, boost::histogram::axis::option::none_t>;
const Axis& axis() {
  static const Axis made(kBins, kLeast_ns, kMost_ns);
  return made;
}

std::size_t bin_of(std::int64_t time_ns) {
  // The axis has no bins for times outside of it, so such a time counts as one just within the nearer end.
  const double inside = std::clamp(static_cast<double>(time_ns), kLeast_ns, kMost_ns * (1 - 1e-9));
  return static_cast<std::size_t>(std::clamp(axis().index(inside), 0, kBins - 1));
}

}  // namespace

void LatencyHistogram::record(std::int64_t time_ns, std::uint64_t count) {
  if (count == 0) return;
  if (bins_.empty()) bins_.resize(kBins);
  bins_[bin_of(time_ns)] += count;
  min_ns_ = count_ == 0 ? time_ns : std::min(min_ns_, time_ns);
  max_ns_ = count_ == 0 ? time_ns : std::max(max_ns_, time_ns);
  count_ += count;
  sum_ns_ += static_cast<double>(time_ns) * static_cast<double>(count);
}

void LatencyHistogram::merge(const LatencyHistogram& other) {
  if (other.count_ == 0) return;
  if (bins_.empty()) bins_.resize(kBins);
  for (std::size_t i = 0; i < bins_.size(); ++i) bins_[i] += other.bins_[i];
  min_ns_ = count_ == 0 ? other.min_ns_ : std::min(min_ns_, other.min_ns_);
  max_ns_ = count_ == 0 ? other.max_ns_ : std::max(max_ns_, other.max_ns_);
  count_ += other.count_;
  sum_ns_ += other.sum_ns_;
}

void LatencyHistogram::clear() {
  std::ranges::fill(bins_, 0);
  count_ = 0;
  min_ns_ = max_ns_ = 0;
  sum_ns_ = 0;
}

double LatencyHistogram::max_ms() const {
  return static_cast<double>(max_ns_) * 1e-6;
}
double LatencyHistogram::min_ms() const {
  return static_cast<double>(min_ns_) * 1e-6;
}
double LatencyHistogram::mean_ms() const {
  return count_ == 0 ? 0 : sum_ns_ / static_cast<double>(count_) * 1e-6;
}

double LatencyHistogram::quantile_ms(double share) const {
  if (count_ == 0) return 0;
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    seen += bins_[i];
    // All later bins are empty, and the maximum is exact, unlike the bin's upper end.
    if (seen == count_) return max_ms();
    if (seen >= std::max<std::uint64_t>(wanted, 1)) {
      const double upper_ns = axis().value(static_cast<double>(i) + 1);
      return std::clamp(upper_ns * 1e-6, min_ms(), max_ms());
    }
  }
  return max_ms();
}

std::vector<std::pair<double, double>> LatencyHistogram::tail(std::size_t points_max) const {
  std::vector<std::pair<double, double>> points;
  if (count_ == 0) return points;
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    if (bins_[i] == 0) continue;
    seen += bins_[i];
    const double upper_ms = std::clamp(axis().value(static_cast<double>(i) + 1) * 1e-6, min_ms(), max_ms());
    points.emplace_back(upper_ms, static_cast<double>(count_ - seen) / static_cast<double>(count_));
  }
  if (points.size() <= points_max) return points;
  // The half with the longest times stays whole, since rare long times are what the plot is for. Of the rest, equally
  // spaced points remain.
  std::vector<std::pair<double, double>> thin;
  const std::size_t kept = points_max / 2, rest = points.size() - kept;
  for (std::size_t i = 0; i < points_max - kept; ++i) thin.push_back(points[i * rest / (points_max - kept)]);
  thin.insert(thin.end(), points.end() - static_cast<std::ptrdiff_t>(kept), points.end());
  return thin;
}

}  // namespace hairnet::load
