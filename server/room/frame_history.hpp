#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "schema/codec/frame_codec.hpp"

namespace hairnet::server {

// The integers of one character's recent frames, by error class, from which new frames are predicted. Buffers are
// reused.
class FrameHistory {
 public:
  // Adds an entry for the frame of `tick`. It replaces an entry older than `keep_from`, if there is one, and reuses its
  // vectors. Valid until the next call. Asserts that the tick has no entry yet.
  codec::FrameIntegers& add(codec::ErrorClass error_class, std::uint64_t tick, std::uint64_t keep_from);
  // Null when there is no frame of that tick. Valid until the next add of that class.
  [[nodiscard]] const codec::FrameIntegers* find(codec::ErrorClass error_class, std::uint64_t tick) const;
  void clear();  // call it after a change of level

 private:
  struct Entry {
    std::uint64_t tick = 0;
    bool in_use = false;
    codec::FrameIntegers integers;
  };
  std::array<std::vector<Entry>, codec::kErrorClassCount> entries_;
};

}  // namespace hairnet::server
