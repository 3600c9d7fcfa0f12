#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "core/random.hpp"
#include "tests/whole/timeline.hpp"

namespace hairnet::whole {

// What a network does to single packets.
struct PathQuality {
  std::int64_t delay_ns = 30 * kMs;         // one way
  std::int64_t jitter_ns = 0;               // beside it, at most; order stays
  double loss = 0;                          // share of packets that get lost
  std::int64_t burst_ns = 0;                // for which all get lost, on average (Gilbert-Elliott); 0: each by itself
  double reorder = 0;                       // share that is held back by kReorderMax_ns at most, and overtaken
  double duplicate = 0;                     // share that arrives twice
  double bytes_per_s = 1e8;                 // of the narrowest link
  std::size_t queue_bytes_max = 64u << 10;  // that wait before it; what comes then is dropped

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
