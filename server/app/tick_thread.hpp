#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>

#include "server/app/server.hpp"

namespace hairnet::server {

// Runs the ticks at their times. `on_tick` is called after each, on this thread.
class TickThread {
 public:
  TickThread(Server& server, TickCounters& counters, std::function<void()> on_tick);
  ~TickThread();

 private:
  void run();
  void count_tick(std::int64_t begun_ns, std::int64_t done_ns);

  Server* server_;
  TickCounters* counters_;
  std::function<void()> on_tick_;
  std::mutex mutex_;
  std::condition_variable stop_;
  bool stopping_ = false;
  std::thread thread_;  // last: it uses the other members
};

}  // namespace hairnet::server
