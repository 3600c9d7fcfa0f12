#pragma once

#include <cstdint>
#include <optional>

namespace hairnet::server {

// When ticks are due: tick n at start + n / rate, even after late ticks. A late tick runs at once, with its own due
// time as its time; when more than `behind_max` are overdue, all but the newest are skipped. It reads no clock itself.
// Tick thread.
class TickClock {
 public:
  TickClock(std::uint32_t rate_hz, std::uint32_t behind_max, std::int64_t start_ns);

  struct Tick {
    std::uint64_t tick = 0;
    // The tick was due at this time.
    std::int64_t time_ns = 0;
    // The number of ticks that were skipped just before this one.
    std::uint64_t skipped = 0;
    // The tick begins late by more than half a period.
    bool late = false;
  };
  // The tick to run now, if one is due. Each call gives one tick at most, so ticks that are overdue but not skipped
  // come one by one.
  std::optional<Tick> take(std::int64_t now_ns);
  [[nodiscard]] std::int64_t next_due_ns() const { return due_ns(next_); }

 private:
  [[nodiscard]] std::int64_t due_ns(std::uint64_t tick) const;

  std::uint32_t rate_hz_, behind_max_;
  std::int64_t start_ns_;
  std::uint64_t next_ = 0;
};

}  // namespace hairnet::server
