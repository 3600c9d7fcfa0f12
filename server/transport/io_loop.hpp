#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

#include "schema/channel/monotonic_clock.hpp"  // all times of the server are on this clock

namespace hairnet::server {

// The part with Asio, which only the transport folder uses.
struct IoLoopCore;

// The I/O thread's event loop. All its tasks run one at a time on the thread that calls run() or poll(). A wake-up
// costs more than most messages, so under load run() wakes about once a millisecond and handles all messages that have
// arrived. Posted tasks, and the first message after an idle time, do not wait for that.
class IoLoop {
 public:
  IoLoop();
  ~IoLoop();
  IoLoop(const IoLoop&) = delete;
  IoLoop& operator=(const IoLoop&) = delete;

  // Runs handlers on the calling thread until stop().
  void run();
  // Runs the handlers that are ready, and returns: for tests, which drive the server from their own loop.
  void poll();
  // Ends run() after the handler under way. Any thread.
  void stop();

  // Runs the task on the loop's thread, soon. Any thread.
  void post(std::function<void()> task);
  // Runs the task once a period, for the loop's life. A task without memory is cut short.
  void every(std::int64_t period_ns, std::function<void()> task);
  // Runs the task at each SIGTERM and SIGINT, which then do not end the program by themselves.
  void on_terminate(std::function<void()> task);

  [[nodiscard]] IoLoopCore& core() { return *core_; }

 private:
  // Ends the wait between two rounds of run().
  void wake();

  std::unique_ptr<IoLoopCore> core_;
  std::mutex mutex_;
  std::condition_variable woken_;
  bool is_woken_ = false;
};

}  // namespace hairnet::server
