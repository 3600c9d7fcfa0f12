#include "tests/whole/fleet_chaos/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hairnet::whole {

std::size_t Times::count_above(std::int64_t ns) const {
  return static_cast<std::size_t>(std::ranges::count_if(ns_, [ns](std::int64_t each) { return each > ns; }));
}

// p50, p99 and the largest, in seconds. A quantile is the smallest value that at least this share of the values does
// not exceed.
std::string Times::text() const {
  if (ns_.empty()) return fmt::format("{:>7} {:>7} {:>7}", "-", "-", "-");
  std::vector<std::int64_t> sorted = ns_;
  std::ranges::sort(sorted);
  const auto at = [&](double share) {
    const double rank = std::ceil(share * static_cast<double>(sorted.size()));
    return 1e-9 * static_cast<double>(sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1]);
  };
  return fmt::format("{:>7.3f} {:>7.3f} {:>7.3f}", at(0.5), at(0.99), at(1));
}

}  // namespace hairnet::whole
