#pragma once

#include <algorithm>
#include <cstdint>

#include "schema/limits.hpp"

namespace hairnet::channel {

// A peer that promised signs of life is lost when nothing has come from it for so long.
inline constexpr std::int64_t kSilence_ns = std::int64_t{wire::kSilence_ms} * 1'000'000;
// Such a peer sends something at least as often as this.
inline constexpr std::int64_t kSignOfLife_ns = kSilence_ns / 4;

// Measures for how long nothing has come from a peer, while this program could receive. After the program was stopped,
// what has arrived meanwhile is read only after the first look().
class Silence {
 public:
  explicit Silence(std::int64_t now_ns) : looked_ns_(now_ns) {}
  void on_heard(std::int64_t now_ns) {
    silent_ns_ = 0;
    looked_ns_ = now_ns;
  }
  // The length of the silence so far. Look at least every kLookEvery_ns.
  std::int64_t look(std::int64_t now_ns) {
    // A longer gap between two looks means that this program did not run. The peer's bytes then wait in the socket, and
    // the silence is not the peer's.
    silent_ns_ += std::min(now_ns - looked_ns_, 2 * kLookEvery_ns);
    looked_ns_ = now_ns;
    return silent_ns_;
  }
  [[nodiscard]] std::int64_t next_look_ns() const { return looked_ns_ + kLookEvery_ns; }

 private:
  static constexpr std::int64_t kLookEvery_ns = 1'000'000'000;
  // The length of the silence at the last look, and the time of that look or of what was heard later.
  std::int64_t silent_ns_ = 0, looked_ns_;
};

}  // namespace hairnet::channel
