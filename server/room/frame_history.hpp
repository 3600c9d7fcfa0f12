#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "schema/codec/frame_codec.hpp"

namespace hairnet::server {

// The integers of one character's recent frames, by error class: what new frames are predicted from. Buffers are
// reused.
class FrameHistory {
 public:
  // A place for the frame of `tick`; it takes the place of one that is before `keep_from`, and its vectors. Valid until
  // the next call.
  codec::FrameIntegers& add(codec::ErrorClass error_class, std::uint64_t tick, std::uint64_t keep_from);
  // Null when it is not there. Valid until the next add of that class.
  [[nodiscard]] const codec::FrameIntegers* find(codec::ErrorClass error_class, std::uint64_t tick) const;
  void clear();  // after a change of level

 private:
  struct Entry {
    std::uint64_t tick = 0;
    bool in_use = false;
    codec::FrameIntegers integers;
  };
  std::array<std::vector<Entry>, codec::kErrorClassCount> entries_;
};

}  // namespace hairnet::server
