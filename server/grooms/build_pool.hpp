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
// be nested. Each build makes its own pool: starting threads costs little beside a build.
class BuildPool {
 public:
  explicit BuildPool(std::size_t thread_count);  // including the caller
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
    std::exception_ptr thrown;  // by the first body that threw
  };
  void help();
  void run_next(Loop& loop, std::unique_lock<std::mutex>& lock);
  Loop* open_loop();

  // Locked except while a body runs. Bodies take milliseconds, so one lock is enough.
  std::mutex mutex_;
  std::condition_variable begun_, ended_;
  std::list<Loop> loops_;  // the outermost, which have the largest bodies, first
  bool stopping_ = false;
  std::vector<std::thread> helpers_;
};

}  // namespace hairnet::server
