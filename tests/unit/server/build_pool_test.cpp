#include "server/grooms/build_pool.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <new>
#include <set>

#include "tests/support/case_name.hpp"

namespace hairnet::server {
namespace {

class BuildPools : public testing::TestWithParam<std::size_t> {};

// A body that runs an inner loop must not only wait for other threads: they may all be waiting in the same way.
TEST_P(BuildPools, loops_within_loops_run_each_body_once) {
  BuildPool pool(GetParam());
  for (int repeat = 0; repeat < 50; ++repeat) {
    std::vector<std::vector<std::atomic<int>>> calls(7);
    for (std::size_t i = 0; i < calls.size(); ++i) calls[i] = std::vector<std::atomic<int>>(3 * i);
    pool.parallel_for(calls.size(), [&](std::size_t i) {
      pool.parallel_for(calls[i].size(),
                        [&](std::size_t j) { pool.parallel_for(3, [&](std::size_t) { ++calls[i][j]; }); });
      // The inner loop has run all its bodies when it returns.
      for (const auto& count : calls[i]) EXPECT_EQ(count, 3);
    });
  }
}

TEST_P(BuildPools, no_more_threads_run_than_asked_for) {
  BuildPool pool(GetParam());
  std::mutex mutex;
  std::set<std::thread::id> threads;
  pool.parallel_for(100, [&](std::size_t) {
    pool.parallel_for(10, [&](std::size_t) {
      const std::lock_guard lock(mutex);
      threads.insert(std::this_thread::get_id());
    });
  });
  EXPECT_LE(threads.size(), std::max<std::size_t>(1, GetParam()));
  if (GetParam() <= 1) {
    EXPECT_TRUE(threads.contains(std::this_thread::get_id()));
  }
}

TEST_P(BuildPools, what_a_body_throws_reaches_the_caller_once_and_the_pool_goes_on) {
  BuildPool pool(GetParam());
  for (int repeat = 0; repeat < 20; ++repeat) {
    std::atomic<int> caught = 0;
    EXPECT_THROW(pool.parallel_for(8,
                                   [&](std::size_t i) {
                                     try {
                                       pool.parallel_for(8, [&](std::size_t j) {
                                         if (j == i) throw std::bad_alloc();
                                       });
                                     } catch (const std::bad_alloc&) {
                                       ++caught;
                                       throw;
                                     }
                                   }),
                 std::bad_alloc);
    EXPECT_GE(caught, 1);
    std::atomic<int> count = 0;
    pool.parallel_for(100, [&](std::size_t) { ++count; });
    EXPECT_EQ(count, 100);
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, BuildPools, testing::Values(0, 1, 2, 5), support::CaseName{"_threads"});

}  // namespace
}  // namespace hairnet::server
