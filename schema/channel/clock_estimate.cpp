#include "schema/channel/clock_estimate.hpp"

#include <algorithm>
#include <limits>

#include "core/assert.hpp"

namespace hairnet::channel {
namespace {

// Samples closer together than this share of the window are merged, which bounds the memory for any rate of a peer.
constexpr std::int64_t kSamplesPerWindow = 256;

// A peer chooses its clock freely, so a sum may exceed 64 bits, which would be undefined behaviour.
std::int64_t saturating_add(std::int64_t a, std::int64_t b) {
  std::int64_t sum = 0;
  if (!__builtin_add_overflow(a, b, &sum)) return sum;
  return a > 0 ? std::numeric_limits<std::int64_t>::max() : std::numeric_limits<std::int64_t>::min();
}

std::int64_t saturating_subtract(std::int64_t a, std::int64_t b) {
  std::int64_t difference = 0;
  if (!__builtin_sub_overflow(a, b, &difference)) return difference;
  return a > b ? std::numeric_limits<std::int64_t>::max() : std::numeric_limits<std::int64_t>::min();
}

}  // namespace

ClockEstimate::ClockEstimate(std::int64_t window_ns) : window_ns_(window_ns) {
  HAIRNET_ASSERT(window_ns > 0);
}

void ClockEstimate::observe(std::int64_t peer_clock_ns, std::int64_t now_ns) {
  const Sample sample{now_ns, saturating_subtract(now_ns, peer_clock_ns)};
  // A later sample with an offset that is no larger makes an earlier one useless: the earlier one leaves the window
  // first. What remains ascends, so the front is the minimum, and each sample is added and removed once.
  while (!window_.empty() && window_.back().offset_ns >= sample.offset_ns) window_.pop_back();
  // The sample that is left out has a larger offset than the last one. Leaving it out lets the estimate change at most
  // 1 / kSamplesPerWindow of the window too early.
  const bool merged =
      !window_.empty() && saturating_subtract(now_ns, window_.back().at_ns) < window_ns_ / kSamplesPerWindow;
  if (!merged) window_.push_back(sample);
  while (saturating_subtract(now_ns, window_.front().at_ns) > window_ns_) window_.pop_front();
  HAIRNET_ASSERT(known());
  HAIRNET_VALIDATE(std::ranges::is_sorted(window_, {}, &Sample::offset_ns));
}

std::int64_t ClockEstimate::to_local(std::int64_t peer_time_ns) const {
  HAIRNET_ASSERT(known());
  return saturating_add(peer_time_ns, window_.front().offset_ns);
}

}  // namespace hairnet::channel
