#include "server/grooms/build_pool.hpp"

#include <system_error>

#include "core/assert.hpp"
#include "server/threading/memory_reserve.hpp"

namespace hairnet::server {

BuildPool::BuildPool(std::size_t thread_count) {
  try {
    for (std::size_t i = 1; i < thread_count; ++i) helpers_.emplace_back([this] { help(); });
  } catch (const std::system_error&) {
    // The system has no thread to spare: those that exist do the work.
  }
}

BuildPool::~BuildPool() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  begun_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
  HAIRNET_ASSERT(loops_.empty());
}

void BuildPool::parallel_for(std::size_t count, const std::function<void(std::size_t)>& body) {
  HAIRNET_ASSERT(body);
  // Without helpers there is nothing to share: the loop runs without the lock, and an exception leaves it at once.
  if (count <= 1 || helpers_.empty()) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  std::unique_lock lock(mutex_);
  // A nested loop goes behind the loops that it is part of.
  const auto loop = loops_.insert(loops_.end(), Loop{body, count, 0, 0, nullptr});
  begun_.notify_all();
  while (loop->next < count) run_next(*loop, lock);
  // Other threads run the rest. They wait for nothing but their own nested loops, so this wait ends.
  ended_.wait(lock, [&] { return loop->done == count; });
  HAIRNET_ASSERT(loop->next == count);
  const std::exception_ptr thrown = loop->thrown;
  loops_.erase(loop);
  if (thrown) std::rethrow_exception(thrown);
}

void BuildPool::help() {
  std::unique_lock lock(mutex_);
  while (true) {
    begun_.wait(lock, [this] { return stopping_ || open_loop(); });
    if (stopping_) return;
    run_next(*open_loop(), lock);
  }
}

void BuildPool::run_next(Loop& loop, std::unique_lock<std::mutex>& lock) {
  HAIRNET_ASSERT(lock.owns_lock());
  HAIRNET_ASSERT(loop.next < loop.count);
  // The index is taken under the lock, so each body runs once.
  const std::size_t i = loop.next++;
  // After an exception the remaining indices are only counted, so that `done` still reaches `count` and the caller
  // wakes.
  const bool is_left_out = loop.thrown != nullptr;
  lock.unlock();
  std::exception_ptr thrown;
  try {
    // An allocation that fails here throws, instead of taking the server's reserve: a groom must not bring the server
    // down.
    const MemoryReserve::MayFail may_fail;
    if (!is_left_out) loop.body(i);
  } catch (...) {
    thrown = std::current_exception();
  }
  lock.lock();
  if (thrown && !loop.thrown) loop.thrown = thrown;
  HAIRNET_ASSERT(loop.done < loop.next);
  if (++loop.done == loop.count) ended_.notify_all();
}

BuildPool::Loop* BuildPool::open_loop() {
  for (Loop& loop : loops_) {
    if (loop.next < loop.count) return &loop;
  }
  return nullptr;
}

}  // namespace hairnet::server
