#include "server/app/duty_thread.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <utility>

namespace hairnet::server {
namespace {

// A tenth of a busy core, and none that a tick wants. Less (nice 19, SCHED_IDLE) and a build never ends where the
// machine is busy throughout.
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
  if (priority_ == Priority::low) lower_priority();
  while (true) {
    while (poll_()) {
    }
    std::unique_lock lock(mutex_);
    if (stopping_ && !wake_) return;
    woken_.wait(lock, [this] { return wake_ || stopping_; });
    wake_ = false;
  }
}

}  // namespace hairnet::server
