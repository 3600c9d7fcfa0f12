#include "server/threading/duty_thread.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// At nice 10 a build gets about a tenth of a busy core and does not slow the tick. With less (nice 19, SCHED_IDLE) a
// build would never end on a machine that is always busy.
void lower_priority() {
  constexpr int kNice = 10;
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
}

}  // namespace

DutyThread::DutyThread(std::function<bool()> poll, Priority priority)
    : poll_(std::move(poll)), priority_(priority), thread_([this] { run(); }) {}

DutyThread::~DutyThread() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  woken_.notify_one();
  thread_.join();
}

void DutyThread::wake() {
  {
    const std::lock_guard lock(mutex_);
    wake_ = true;
  }
  woken_.notify_one();
}

void DutyThread::run() {
  HAIRNET_ASSERT(poll_);
  if (priority_ == Priority::low) lower_priority();
  while (true) {
    // The lock is not held here: wake() must never wait for a duty.
    while (poll_()) {
    }
    std::unique_lock lock(mutex_);
    // A wake-up that came just before the end is still served.
    if (stopping_ && !wake_) return;
    woken_.wait(lock, [this] { return wake_ || stopping_; });
    wake_ = false;
  }
}

}  // namespace hairnet::server
