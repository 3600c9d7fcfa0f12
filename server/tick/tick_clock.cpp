#include "server/tick/tick_clock.hpp"

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

}  // namespace

TickClock::TickClock(std::uint32_t rate_hz, std::uint32_t behind_max, std::int64_t start_ns)
    : rate_hz_(rate_hz), behind_max_(behind_max), start_ns_(start_ns) {
  HAIRNET_ASSERT(rate_hz > 0);
}

std::int64_t TickClock::due_ns(std::uint64_t tick) const {
  // In whole seconds plus a remainder, so that a product never overflows and the rate never drifts.
  return start_ns_ + static_cast<std::int64_t>(tick / rate_hz_) * kSecond_ns +
         static_cast<std::int64_t>(tick % rate_hz_) * kSecond_ns / rate_hz_;
}

std::optional<TickClock::Tick> TickClock::take(std::int64_t now_ns) {
  if (now_ns < due_ns(next_)) return {};
  const std::uint64_t first = next_;
  // The estimate may be one off in either direction, because a period is not a whole number of nanoseconds; the two
  // loops correct it.
  std::uint64_t overdue = static_cast<std::uint64_t>(now_ns - due_ns(next_)) * rate_hz_ / kSecond_ns;
  while (due_ns(next_ + overdue) > now_ns) --overdue;
  while (due_ns(next_ + overdue + 1) <= now_ns) ++overdue;
  HAIRNET_ASSERT(due_ns(next_ + overdue) <= now_ns);
  // A few overdue ticks are made up for, so that a short stall loses no frame. More of them would keep the server late,
  // since each costs time, too.
  if (overdue > behind_max_) next_ += overdue;
  Tick tick{next_, due_ns(next_), next_ - first, false};
  // Half a period separates jitter of the system's timers from a server that is too slow.
  tick.late = now_ns - tick.time_ns > kSecond_ns / rate_hz_ / 2;
  ++next_;
  HAIRNET_ASSERT(tick.time_ns <= now_ns);
  HAIRNET_ASSERT(tick.time_ns < next_due_ns());
  return tick;
}

}  // namespace hairnet::server
