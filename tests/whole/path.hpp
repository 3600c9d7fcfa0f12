#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "core/random.hpp"
#include "tests/whole/timeline.hpp"

namespace hairnet::whole {

// What a network does to single packets.
struct PathQuality {
  // The delay in one direction.
  std::int64_t delay_ns = 30 * kMs;
  // The largest random delay beside `delay_ns`. Packets stay in order.
  std::int64_t jitter_ns = 0;
  // The share of packets that get lost.
  double loss = 0;
  // Losses come in bursts of this mean length, in which all packets get lost (Gilbert-Elliott). Zero means that each
  // packet gets lost by itself.
  std::int64_t burst_ns = 0;
  // The share of packets that are held back, by kReorderMax_ns at most, so that later packets overtake them.
  double reorder = 0;
  // The share of packets that arrive twice.
  double duplicate = 0;
  // The rate of the narrowest link of the path.
  double bytes_per_s = 1e8;
  // The most bytes that wait before this link. Packets that come when the queue is full are dropped.
  std::size_t queue_bytes_max = 64u << 10;

  static constexpr std::int64_t kReorderMax_ns = 60 * kMs;
};

// Carries packets one way: late, twice, out of order, or not at all. What happens follows from the seed.
class Path {
 public:
  Path(Timeline& timeline, const PathQuality& quality, std::uint64_t seed)
      : timeline_(&timeline), quality_(quality), random_(seed, 3) {}

  // `arrive` is called at each arrival.
  void send(std::size_t bytes, const std::function<void()>& arrive);
  [[nodiscard]] const PathQuality& quality() const { return quality_; }

 private:
  bool is_lost();

  Timeline* timeline_;
  PathQuality quality_;
  Random random_;
  bool in_burst_ = false;
  // The time at which the present burst, or the time without one, ends.
  std::int64_t burst_changes_ns_ = 0;
  // The time from which the narrowest link is free, and the newest arrival of a packet that keeps its order.
  std::int64_t free_ns_ = 0, last_arrival_ns_ = 0;
};

}  // namespace hairnet::whole
