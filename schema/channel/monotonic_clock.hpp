#pragma once

#include <chrono>
#include <cstdint>

namespace hairnet::viewer {

// Nanoseconds of a clock that only goes forward; its 0 means nothing. Any thread.
inline std::int64_t steady_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace hairnet::viewer
