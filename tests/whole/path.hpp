#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "core/random.hpp"
#include "tests/whole/timeline.hpp"

namespace hairnet::whole {

// What a network does to single packets.
struct PathQuality {
  // Is the delay in one direction.
  std::int64_t delay_ns = 30 * kMs;
  // Is added to the delay, at most; order stays.
  std::int64_t jitter_ns = 0;
  // Is the share of packets that get lost.
  double loss = 0;
  // All get lost for so long, on average (Gilbert-Elliott); zero means each by itself.
  std::int64_t burst_ns = 0;
  // Is the share that is held back by kReorderMax_ns at most, and overtaken.
  double reorder = 0;
  // Is the share that arrives twice.
  double duplicate = 0;
  // Is the rate of the narrowest link.
  double bytes_per_s = 1e8;
  // Limits what waits before that link; what comes then is dropped.
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
  std::int64_t burst_changes_ns_ = 0;
  std::int64_t free_ns_ = 0, last_arrival_ns_ = 0;
};

}  // namespace hairnet::whole
