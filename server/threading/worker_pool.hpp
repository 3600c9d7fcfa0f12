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
  // The count includes the calling thread, so 1 or 0 makes no helper.
  explicit WorkerPool(std::size_t worker_count);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  // Calls body(i) for each i in [0, count) and returns when all are done. Asserts that there is one
  // caller at a time, and that a body does not call it; `body` must not throw.
  void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body);

 private:
  // A helper's life: waits for a round, works, and waits again.
  void help();
  // Takes indices until none is left. Helpers and the caller share them by one atomic counter.
  void work(std::size_t count, const std::function<void(std::size_t)>& body);

  std::mutex mutex_;
  std::condition_variable begun_, ended_;
  // The number of the present loop, so that a helper works on each loop once.
  std::uint64_t round_ = 0;
  // The number of helpers that work on this loop.
  std::size_t helping_ = 0;
  bool stopping_ = false;
  // Null: no helper may begin. The function belongs to the caller's stack, so it must not be used after parallel_for()
  // has returned.
  const std::function<void(std::size_t)>* body_ = nullptr;
  // The number of bodies of the present loop, and the index that is taken next.
  std::size_t count_ = 0;
  std::atomic<std::size_t> next_{0};
  std::vector<std::thread> helpers_;
};

}  // namespace hairnet::server
