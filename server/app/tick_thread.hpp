#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>

#include "server/app/server.hpp"

namespace hairnet::server {

// Runs the ticks at their times. `on_tick` is called after each, on this thread. The destructor waits for a tick under
// way to end. The server and the counters must outlive it.
class TickThread {
 public:
  TickThread(Server& server, TickCounters& counters, std::function<void()> on_tick);
  ~TickThread();

 private:
  void run();
  // Counts the duration of a tick. A tick that takes longer than its period is an overrun, even if the next one is not
  // late yet.
  void count_tick(std::int64_t begun_ns, std::int64_t done_ns);

  Server* server_;
  TickCounters* counters_;
  std::function<void()> on_tick_;
  std::mutex mutex_;
  std::condition_variable stop_;
  bool stopping_ = false;
  // Comes last, since it uses the other members.
  std::thread thread_;
};

}  // namespace hairnet::server
