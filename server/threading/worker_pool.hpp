#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace hairnet::server {

// Runs the tick's independent loops on the calling thread and helpers. Results do not depend on the number of helpers.
// A loop never waits for a helper that has not begun: one that the system wakes late finds the loop done.
class WorkerPool {
 public:
  explicit WorkerPool(std::size_t worker_count);  // including the caller
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  // Calls body(i) for each i in [0, count) and returns when all are done. Asserts that there is one
  // caller at a time, and that a body does not call it; `body` must not throw.
  void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body);

 private:
  void help();
  void work(std::size_t count, const std::function<void(std::size_t)>& body);

  std::mutex mutex_;
  std::condition_variable begun_, ended_;
  std::uint64_t round_ = 0;
  std::size_t helping_ = 0;  // helpers that work on this round
  bool stopping_ = false;
  const std::function<void(std::size_t)>* body_ = nullptr;  // null: no helper may begin
  std::size_t count_ = 0;
  std::atomic<std::size_t> next_{0};
  std::vector<std::thread> helpers_;
};

}  // namespace hairnet::server
