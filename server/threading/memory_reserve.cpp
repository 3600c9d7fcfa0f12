#include "server/threading/memory_reserve.hpp"

#include <chrono>
#include <cstdlib>
#include <new>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

using Clock = std::chrono::steady_clock;

// Two failures of a thread that are further apart belong to two waits.
constexpr std::chrono::seconds kSameWait{1};
// A thread that waits for memory tries again after this time.
constexpr std::chrono::milliseconds kRetry{1};

std::atomic<MemoryReserve*> reserve{nullptr};
// The number of times that a reserve was spent, in the whole process.
std::atomic<std::uint64_t> spent_count{0};
thread_local bool may_fail = false;
// The value of spent_count at this thread's last try.
thread_local std::uint64_t spent_count_seen = 0;
// The first and the newest failure of this thread's wait.
thread_local Clock::time_point wait_begun, wait_last;

}  // namespace

MemoryReserve::MemoryReserve(std::size_t bytes)
    : bytes_(bytes), owner_(std::this_thread::get_id()), block_(std::malloc(bytes)) {
  HAIRNET_ASSERT(bytes > 0);
  MemoryReserve* const former = reserve.exchange(this);
  HAIRNET_ASSERT(!former);
  // operator new calls the handler, and tries again whenever it returns.
  std::set_new_handler(on_failed_allocation);
}

MemoryReserve::~MemoryReserve() {
  std::set_new_handler(nullptr);
  reserve = nullptr;
  std::free(block_.load());
}

bool MemoryReserve::refill() {
  HAIRNET_ASSERT(std::this_thread::get_id() == owner_);
  if (!is_spent()) return true;
  block_ = std::malloc(bytes_);
  return !is_spent();
}

bool MemoryReserve::spend() {
  // Several threads may fail at once; only one of them gets the block to free.
  void* const block = block_.exchange(nullptr);
  if (!block) return false;
  ++spent_count;
  std::free(block);
  return true;
}

void MemoryReserve::on_failed_allocation() {
  MemoryReserve* const its = reserve.load();
  if (!its || may_fail) throw std::bad_alloc();
  its->spend();
  // Each time that the reserve is spent, by any thread, every thread tries once more.
  const std::uint64_t count = spent_count;
  if (std::exchange(spent_count_seen, count) != count) return;
  // The owner frees memory by ending sessions. If it waited here, nobody would.
  if (std::this_thread::get_id() == its->owner_) throw std::bad_alloc();
  const Clock::time_point now = Clock::now();
  if (now - wait_last > kSameWait) wait_begun = now;
  wait_last = now;
  if (now - wait_begun > std::chrono::nanoseconds(kWaitMax_ns)) throw std::bad_alloc();
  std::this_thread::sleep_for(kRetry);
}

MemoryReserve::MayFail::MayFail() : before_(std::exchange(may_fail, true)) {}

MemoryReserve::MayFail::~MayFail() {
  may_fail = before_;
}

}  // namespace hairnet::server
