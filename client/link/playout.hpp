#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "core/build/level.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// Frames of one character, played out smoothly a little behind the newest: interpolated between two, held at the last
// for a moment when none comes, then eased to rest.
class Playout {
 public:
  // Frames older than what was already played are dropped. Times on the client's clock.
  void push(const wire::Frame& frame, std::int64_t sample_time_ns);
  struct Sample {
    bool valid = false;                          // false until the first frame
    Pose pose;
    LevelIndex level = LevelIndex::rigid;
    std::span<const Vec3f> displacement;         // active order of `level`, head space, m; empty = rigid
  };
  Sample sample(std::int64_t render_time_ns);

 private:
  struct Held { std::int64_t time_ns; bool discontinuous; Pose pose; LevelIndex level; std::vector<Vec3f> displacement; };
  std::deque<Held> frames_;
  std::vector<Vec3f> sampled_;
};

}  // namespace hairnet::link
