#include "server/app/tick_thread.hpp"

#include <chrono>
#include <utility>

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

void TickThread::run() {
  while (true) {
    const std::int64_t begun_ns = monotonic_now_ns();
    if (server_->poll_tick(begun_ns)) {
      const auto spent_ns = static_cast<std::uint64_t>(monotonic_now_ns() - begun_ns);
      counters_->tick_ns_total.add(spent_ns);
      counters_->tick_ns_max.raise_to(spent_ns);
      on_tick_();
    }
    const std::chrono::steady_clock::time_point due{std::chrono::nanoseconds(server_->next_tick_ns())};
    std::unique_lock lock(mutex_);
    if (stop_.wait_until(lock, due, [this] { return stopping_; })) return;
  }
}

}  // namespace hairnet::server
