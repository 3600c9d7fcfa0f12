#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "server/app/metrics.hpp"
#include "server/threading/memory_reserve.hpp"

namespace hairnet::server {

// How the server sees the memory of its process.
struct ProcessMemory {
  // Bounds resident memory; zero: there is no bound.
  std::size_t bytes_max = 0;
  // The process' memory in RAM, and the bytes that its allocator has given out.
  std::function<std::size_t()> resident_bytes, allocated_bytes;
  // Returns memory that the allocator has and nobody uses to the system.
  std::function<void()> give_back;
  // Null: there is no reserve.
  MemoryReserve* reserve = nullptr;
};

// Finds out when the process has as much memory as it may have, and returns unused memory to the system after a peak.
// I/O thread, except is_full().
class MemoryWatch {
 public:
  // Memory is full from `bytes_max` until it is below this share of it.
  static constexpr double kRefillShare = 0.95;
  // Memory is given back at most this often, because it takes time.
  static constexpr std::int64_t kGiveBackInterval_ns = 2'000'000'000;
  // Unused memory is given back when there is this much. The step is small, because other threads cannot allocate
  // meanwhile.
  static constexpr std::size_t kGiveBack_bytes = std::size_t{32} << 20;

  MemoryWatch(ProcessMemory memory, ProgramGauges& gauges, ProgramCounters& counters);

  // Looks at the memory, refills the reserve, and gives unused memory back.
  void poll(std::int64_t now_ns);
  // The server must not take what needs more memory. Any thread.
  [[nodiscard]] bool is_full() const { return is_full_ || (memory_.reserve && memory_.reserve->is_spent()); }

 private:
  // Gives unused memory back if there has been enough of it since the last time.
  void give_back(std::size_t resident_bytes, std::int64_t now_ns);

  ProcessMemory memory_;
  ProgramGauges* gauges_;
  ProgramCounters* counters_;
  std::atomic<bool> is_full_{false};
  // The reserve is spent, and this use of it has been counted: polls that cannot refill it count no other.
  bool use_is_counted_ = false;
  std::int64_t give_back_next_ns_ = 0;
  bool gave_back_ = false;
  // The least memory that was resident and not allocated since memory was last given back.
  std::ptrdiff_t unused_least_ = 0;
};

}  // namespace hairnet::server
