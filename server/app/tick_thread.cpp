#include "server/app/tick_thread.hpp"

#include <chrono>
#include <utility>

#include "core/assert.hpp"
#include "server/transport/io_loop.hpp"

namespace hairnet::server {

TickThread::TickThread(Server& server, TickCounters& counters, std::function<void()> on_tick)
    : server_(&server), counters_(&counters), on_tick_(std::move(on_tick)), thread_([this] { run(); }) {}

TickThread::~TickThread() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.notify_one();
  thread_.join();
}

void TickThread::count_tick(std::int64_t begun_ns, std::int64_t done_ns) {
  HAIRNET_ASSERT(done_ns >= begun_ns);
  const auto spent_ns = static_cast<std::uint64_t>(done_ns - begun_ns);
  const double spent_s = static_cast<double>(spent_ns) * 1e-9;
  const double budget_used = spent_s / counters_->gauges.tick_period_seconds.value();
  counters_->tick_ns_total.add(spent_ns);
  counters_->tick_ns_max.raise_to(spent_ns);
  if (budget_used > 1) counters_->ticks_overrun.add();
  counters_->histograms.tick_seconds.observe(spent_s);
  counters_->histograms.tick_period_used_ratio.observe(budget_used);
  counters_->gauges.last_tick_ns.store(done_ns, std::memory_order_relaxed);
}

void TickThread::run() {
  while (true) {
    const std::int64_t begun_ns = channel::monotonic_ns();
    if (server_->poll_tick(begun_ns)) {
      count_tick(begun_ns, channel::monotonic_ns());
      // The I/O thread is woken only after the whole tick, with the frames of all sessions at once.
      on_tick_();
    }
    // monotonic_ns() counts on the same clock, so a due time needs no conversion.
    const std::chrono::steady_clock::time_point due{std::chrono::nanoseconds(server_->next_tick_ns())};
    std::unique_lock lock(mutex_);
    // A time in the past returns at once: overdue ticks run one after the other.
    if (stop_.wait_until(lock, due, [this] { return stopping_; })) return;
  }
}

}  // namespace hairnet::server
