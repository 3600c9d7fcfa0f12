#include "server/threading/worker_pool.hpp"

#include "core/assert.hpp"

namespace hairnet::server {

WorkerPool::WorkerPool(std::size_t worker_count) {
  for (std::size_t i = 1; i < worker_count; ++i) helpers_.emplace_back([this] { help(); });
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  begun_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
}

void WorkerPool::parallel_for(std::size_t count, const std::function<void(std::size_t)>& body) {
  HAIRNET_ASSERT(body);
  // Waking a helper costs more than one body.
  if (count <= 1 || helpers_.empty()) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    HAIRNET_ASSERT(helping_ == 0);
    HAIRNET_ASSERT(!body_);
    HAIRNET_ASSERT(!stopping_);
    body_ = &body;
    count_ = count;
    // The lock orders this store before every helper of the round.
    next_.store(0, std::memory_order_relaxed);
    ++round_;
  }
  // Each body needs one thread at most, and the caller takes one: more helpers would wake for nothing.
  if (count > helpers_.size()) {
    begun_.notify_all();
  } else {
    for (std::size_t i = 1; i < count; ++i) begun_.notify_one();
  }
  work(count, body);
  std::unique_lock lock(mutex_);
  // A helper that the system wakes only now finds no body, so the caller waits for those alone that have begun.
  body_ = nullptr;
  ended_.wait(lock, [this] { return helping_ == 0; });
  HAIRNET_ASSERT(next_.load() >= count);
}

void WorkerPool::help() {
  std::uint64_t round = 0;
  std::unique_lock lock(mutex_);
  while (true) {
    begun_.wait(lock, [&] { return stopping_ || (body_ && round_ != round); });
    if (stopping_) return;
    round = round_;
    ++helping_;
    const std::size_t count = count_;
    // The copies are taken under the lock; `body` stays valid as long as this helper is counted in helping_.
    const std::function<void(std::size_t)>& body = *body_;
    lock.unlock();
    work(count, body);
    lock.lock();
    HAIRNET_ASSERT(helping_ > 0);
    if (--helping_ == 0) ended_.notify_one();
  }
}

void WorkerPool::work(std::size_t count, const std::function<void(std::size_t)>& body) {
  // Bodies differ in length, so threads take one index at a time; callers with short bodies give chunks of them
  // (run_chunks).
  for (std::size_t i = next_.fetch_add(1); i < count; i = next_.fetch_add(1)) body(i);
}

}  // namespace hairnet::server
