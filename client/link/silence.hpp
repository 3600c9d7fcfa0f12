#pragma once

#include <algorithm>
#include <cstdint>

#include "schema/limits.hpp"

namespace hairnet::link {

// For how long nothing has come from the server, counted while this program could receive: what arrived while it was
// stopped is read after the look that comes first.
class Silence {
 public:
  static constexpr std::int64_t kMost_ns = std::int64_t{wire::kSilentServer_ms} * 1'000'000;

  void on_heard(std::int64_t now_ns) {
    silent_ns_ = 0;
    looked_ns_ = now_ns;
  }
  // Whether the server has been silent for too long.
  [[nodiscard]] bool look(std::int64_t now_ns) {
    silent_ns_ += std::min(now_ns - looked_ns_, kLookMost_ns);
    looked_ns_ = now_ns;
    return silent_ns_ >= kMost_ns;
  }
  // When to look again.
  [[nodiscard]] std::int64_t next_look_ns() const {
    return looked_ns_ + std::min(kLookEvery_ns, kMost_ns - silent_ns_);
  }

 private:
  static constexpr std::int64_t kLookEvery_ns = 1'000'000'000;
  static constexpr std::int64_t kLookMost_ns = 2'000'000'000;  // that a look adds
  std::int64_t silent_ns_ = 0, looked_ns_ = 0;
};

}  // namespace hairnet::link
