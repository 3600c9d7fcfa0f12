#include "tests/whole/path.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet::whole {

// There are two states of random length: in a burst all packets get lost, between bursts none. The mean times are such
// that bursts are `loss` of all time. Each path begins with a burst, so that the first packets of a session get lost.
bool Path::is_lost() {
  if (quality_.loss <= 0) return false;
  if (quality_.burst_ns <= 0) return random_.unit() < quality_.loss;
  const auto burst_ns = static_cast<double>(quality_.burst_ns);
  while (burst_changes_ns_ <= timeline_->now_ns()) {
    in_burst_ = !in_burst_;
    const double mean_ns = in_burst_ ? burst_ns : burst_ns * (1 - quality_.loss) / quality_.loss;
    burst_changes_ns_ += 1 + static_cast<std::int64_t>(-mean_ns * std::log(1 - random_.unit()));
  }
  return in_burst_;
}

// Losses happen behind the narrowest link, so a packet that gets lost occupies this link like any other.
void Path::send(std::size_t bytes, const std::function<void()>& arrive) {
  const std::int64_t now_ns = timeline_->now_ns();
  const double waiting_bytes =
      1e-9 * static_cast<double>(std::max<std::int64_t>(free_ns_ - now_ns, 0)) * quality_.bytes_per_s;
  if (waiting_bytes + static_cast<double>(bytes) > static_cast<double>(quality_.queue_bytes_max)) return;
  free_ns_ =
      std::max(free_ns_, now_ns) + static_cast<std::int64_t>(1e9 * static_cast<double>(bytes) / quality_.bytes_per_s);
  if (is_lost()) return;
  const auto up_to = [this](std::int64_t max_ns) {
    return static_cast<std::int64_t>(random_.unit() * static_cast<double>(max_ns));
  };
  std::int64_t arrival_ns = free_ns_ + quality_.delay_ns + up_to(quality_.jitter_ns);
  if (random_.unit() < quality_.reorder) {
    arrival_ns += up_to(PathQuality::kReorderMax_ns);
  } else {
    arrival_ns = last_arrival_ns_ = std::max(arrival_ns, last_arrival_ns_);
  }
  timeline_->at(arrival_ns, arrive);
  if (random_.unit() < quality_.duplicate) timeline_->at(arrival_ns + up_to(PathQuality::kReorderMax_ns), arrive);
}

}  // namespace hairnet::whole
