#pragma once

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <list>
#include <mutex>
#include <thread>
#include <vector>

namespace hairnet::server {

// Runs the parallel loops of a groom's build on the calling thread and helper threads of the same priority. Loops may
// be nested. Each build makes its own pool: starting threads costs little beside a build. The tick has another pool
// (threading/), because a build must never hold up a tick.
class BuildPool {
 public:
  // `thread_count` includes the caller. The pool has fewer threads where the system has none to spare.
  explicit BuildPool(std::size_t thread_count);
  ~BuildPool();
  BuildPool(const BuildPool&) = delete;
  BuildPool& operator=(const BuildPool&) = delete;

  // Calls body(i) for each i in [0, count) and returns when all are done. When a body throws, throws its exception
  // then; bodies that have not begun are left out.
  void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body);

 private:
  struct Loop {
    const std::function<void(std::size_t)>& body;
    std::size_t count, next = 0, done = 0;
    // The exception of the first body that has thrown one; null: none has.
    std::exception_ptr thrown;
  };
  // The body of a helper thread.
  void help();
  // Runs the next body of the loop. The lock is open while the body runs.
  void run_next(Loop& loop, std::unique_lock<std::mutex>& lock);
  // Returns the first loop with a body that no thread has begun; null: there is none.
  Loop* open_loop();

  // Locked except while a body runs. Bodies take milliseconds, so one lock is enough.
  std::mutex mutex_;
  std::condition_variable begun_, ended_;
  // The outermost loops, which have the largest bodies, come first: helpers prefer them, so few small pieces are left
  // at the end.
  std::list<Loop> loops_;
  bool stopping_ = false;
  std::vector<std::thread> helpers_;
};

}  // namespace hairnet::server
