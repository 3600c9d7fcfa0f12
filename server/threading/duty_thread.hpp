#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace hairnet::server {

// A thread for one duty: calls `poll` while it has work, then sleeps until it is woken.
class DutyThread {
 public:
  enum class Priority { normal, low };
  DutyThread(std::function<bool()> poll, Priority priority);
  ~DutyThread();  // lets `poll` finish its work, and ends the thread
  void wake();    // any thread

 private:
  void run();

  std::function<bool()> poll_;
  Priority priority_;
  std::mutex mutex_;
  std::condition_variable woken_;
  bool wake_ = true, stopping_ = false;
  std::thread thread_;  // last: it uses the other members
};

}  // namespace hairnet::server
