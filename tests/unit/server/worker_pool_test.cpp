#include "server/threading/worker_pool.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <barrier>
#include <vector>

namespace hairnet::server {
namespace {

TEST(WorkerPool, calls_each_index_once_for_any_worker_count) {
  for (const std::size_t workers : {1, 2, 5}) {
    WorkerPool pool(workers);
    for (int round = 0; round < 200; ++round) {
      std::vector<std::atomic<int>> calls(round % 17);
      pool.parallel_for(calls.size(), [&](std::size_t i) { ++calls[i]; });
      for (const auto& count : calls) ASSERT_EQ(count, 1);
    }
  }
}

TEST(WorkerPool, has_a_thread_for_each_call_up_to_its_workers) {
  constexpr int kWorkers = 5;
  WorkerPool pool(kWorkers);
  for (int round = 0; round < 200; ++round) {
    const int count = 2 + round % (kWorkers - 1);
    std::barrier all_are_here(count);
    pool.parallel_for(static_cast<std::size_t>(count), [&](std::size_t) { all_are_here.arrive_and_wait(); });
  }
}

}  // namespace
}  // namespace hairnet::server
