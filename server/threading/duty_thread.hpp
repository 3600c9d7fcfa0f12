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
  // `poll` returns whether it has done something, and is called again until it has not. It must not throw.
  DutyThread(std::function<bool()> poll, Priority priority);
  // Lets `poll` finish its work, and ends the thread.
  ~DutyThread();
  // There may be work. Any thread; a call during `poll` is not lost.
  void wake();

 private:
  void run();

  std::function<bool()> poll_;
  Priority priority_;
  std::mutex mutex_;
  std::condition_variable woken_;
  // wake() was called since the last poll; the first poll needs no call.
  bool wake_ = true, stopping_ = false;
  // Comes last, since it uses the other members.
  std::thread thread_;
};

}  // namespace hairnet::server
