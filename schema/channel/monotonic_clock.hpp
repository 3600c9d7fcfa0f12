#pragma once

#include <chrono>
#include <cstdint>

namespace hairnet::channel {

// Now, in nanoseconds, on the clock that a program puts into its envelopes. It only goes forward; its 0 means nothing.
// Any thread.
inline std::int64_t monotonic_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace hairnet::channel
