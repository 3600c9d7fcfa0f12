#pragma once

#include <atomic>
#include <cstdint>
#include <limits>

namespace hairnet::server {

// Until when this server may act as the owner of its rooms, on its own monotonic clock. The I/O thread moves the
// deadline, any thread may ask. Once the deadline has passed, frames of all rooms must stop: the directory may give the
// rooms to another server soon after.
class LeaseFence {
 public:
  // For a server without a fleet, whose rooms nobody else can have.
  static constexpr std::int64_t kAlways = std::numeric_limits<std::int64_t>::max();

  [[nodiscard]] bool is_open(std::int64_t now_ns) const { return now_ns < until_ns_.load(std::memory_order_acquire); }
  [[nodiscard]] std::int64_t until_ns() const { return until_ns_.load(std::memory_order_acquire); }
  void open_until(std::int64_t until_ns) { until_ns_.store(until_ns, std::memory_order_release); }
  // Closes the fence at once.
  void close() { open_until(0); }

 private:
  // The fence is open before this time; 0: it is closed.
  std::atomic<std::int64_t> until_ns_{0};
};

}  // namespace hairnet::server
