#include "server/transport/io_loop.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <csignal>
#include <new>
#include <utility>

#include "core/assert.hpp"
#include "server/transport/io_loop_core.hpp"

namespace hairnet::server {
namespace {

// run() waits this long between two wake-ups, so that messages gather. A longer pause saves more wake-ups and delays
// each pose by more; a millisecond is small beside a tick.
constexpr std::chrono::milliseconds kBetweenWakes{1};

// A task that finds no memory is cut short; the loop goes on.
void run_task(const std::function<void()>& task) {
  try {
    task();
  } catch (const std::bad_alloc&) {
    spdlog::error("event=out_of_memory");
  }
}

// Runs the task once a period, without end.
asio::awaitable<void> repeat(std::chrono::nanoseconds period, std::function<void()> task) {
  asio::steady_timer timer(co_await asio::this_coro::executor);
  while (true) {
    // The period counts from the end of the last run: a slow task delays the next one and never makes a backlog.
    timer.expires_after(period);
    co_await timer.async_wait(kAwaitable);
    run_task(task);
  }
}

// Runs the task at each signal of core.signals, until the loop ends.
void wait_for_signal(IoLoopCore& core, const std::shared_ptr<std::function<void()>>& task) {
  // Each signal needs a new wait; a second Ctrl-C must reach the program, too.
  core.signals.async_wait(asio::bind_executor(core.serial, [&core, task](const boost::system::error_code& error, int) {
    // The loop is ending.
    if (error) return;
    (*task)();
    wait_for_signal(core, task);
  }));
}

}  // namespace

IoLoop::IoLoop() : core_(std::make_unique<IoLoopCore>()) {}
IoLoop::~IoLoop() = default;

void IoLoop::run() {
  while (!core_->context.stopped()) {
    // Without anything ready, run_one() sleeps in the system until the first byte, task or timer comes.
    if (core_->context.poll() == 0) core_->context.run_one();
    std::unique_lock lock(mutex_);
    // The pause lets messages gather. post() ends it, so a tick's frames leave at once.
    woken_.wait_for(lock, kBetweenWakes, [this] { return is_woken_; });
    is_woken_ = false;
  }
}

void IoLoop::poll() {
  core_->context.poll();
}

void IoLoop::stop() {
  core_->context.stop();
  wake();
}

void IoLoop::post(std::function<void()> task) {
  HAIRNET_ASSERT(task);
  asio::post(core_->serial, [task = std::move(task)] { run_task(task); });
  wake();
}

void IoLoop::wake() {
  const std::lock_guard lock(mutex_);
  is_woken_ = true;
  woken_.notify_one();
}

void IoLoop::every(std::int64_t period_ns, std::function<void()> task) {
  HAIRNET_ASSERT(period_ns > 0);
  HAIRNET_ASSERT(task);
  asio::co_spawn(core_->serial, repeat(std::chrono::nanoseconds(period_ns), std::move(task)), asio::detached);
}

void IoLoop::on_terminate(std::function<void()> task) {
  HAIRNET_ASSERT(task);
  core_->signals.add(SIGTERM);
  core_->signals.add(SIGINT);
  wait_for_signal(*core_, std::make_shared<std::function<void()>>(std::move(task)));
}

}  // namespace hairnet::server
