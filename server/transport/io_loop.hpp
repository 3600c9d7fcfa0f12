#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

#include "schema/channel/monotonic_clock.hpp"  // all times of the server are on this clock

namespace hairnet::server {

struct IoLoopCore;  // the Asio part; only the transport folder uses it

// The I/O thread's event loop. All its tasks run one at a time on the thread that calls run() or poll(). A wake-up
// costs more than most messages, so under load run() wakes about once a millisecond and handles all messages that have
// arrived. Posted tasks, and the first message after an idle time, do not wait for that.
class IoLoop {
 public:
  IoLoop();
  ~IoLoop();
  IoLoop(const IoLoop&) = delete;
  IoLoop& operator=(const IoLoop&) = delete;

  void run();   // until stop()
  void poll();  // runs the ready handlers, and returns
  void stop();  // any thread

  void post(std::function<void()> task);                           // any thread
  void every(std::int64_t period_ns, std::function<void()> task);  // for the loop's life
  void on_terminate(std::function<void()> task);                   // SIGTERM or SIGINT, each time

  [[nodiscard]] IoLoopCore& core() { return *core_; }

 private:
  void wake();

  std::unique_ptr<IoLoopCore> core_;
  std::mutex mutex_;
  std::condition_variable woken_;
  bool is_woken_ = false;
};

}  // namespace hairnet::server
