#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>

namespace hairnet::server {

// A block of memory for the time when the system gives no more: with it, the process can still end sessions and evict
// grooms in an orderly way. While the object lives (one at a time), an allocation that fails takes the reserve and is
// tried again. Without a reserve left, the allocation waits until other threads have freed memory; it throws
// std::bad_alloc after kWaitMax_ns. Two kinds of threads do not wait: the owner, which made the reserve, because it is
// the one that frees memory, and threads in a scope of MayFail, which never take the reserve.
class MemoryReserve {
 public:
  static constexpr std::int64_t kWaitMax_ns = 30'000'000'000;

  explicit MemoryReserve(std::size_t bytes);
  ~MemoryReserve();
  MemoryReserve(const MemoryReserve&) = delete;
  MemoryReserve& operator=(const MemoryReserve&) = delete;

  // True from the first failed allocation until refill() succeeds. Any thread.
  [[nodiscard]] bool is_spent() const { return !block_.load(std::memory_order_relaxed); }
  // Takes a new reserve if the last one is spent. Returns false when the system does not give that much. Only the
  // owner's thread may call it.
  bool refill();

  // For large allocations whose failure ends one job: they throw std::bad_alloc at once. Belongs to the thread that
  // makes it, until the scope ends; scopes may be nested.
  class MayFail {
   public:
    MayFail();
    ~MayFail();
    MayFail(const MayFail&) = delete;
    MayFail& operator=(const MayFail&) = delete;

   private:
    // Whether the thread was in such a scope before.
    bool before_;
  };

 private:
  // The handler of operator new (std::set_new_handler), on the thread whose allocation has failed.
  static void on_failed_allocation();
  // Frees the reserve for others to allocate. False: it is spent already.
  bool spend();

  const std::size_t bytes_;
  const std::thread::id owner_;
  // The reserve; null: it is spent.
  std::atomic<void*> block_;
};

}  // namespace hairnet::server
