#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/modes/mode_map.hpp"

namespace hairnet::server {

// The coefficients of one character's hair from tick to tick. When the level changes, they come from another map: the
// difference that the change makes is added back and fades out, so that hair never jumps. Tick thread and workers.
class CoefficientTrack {
 public:
  // The coefficients at a later tick, or the same. `map`: of the level; null: the hair is at rest, all are 0.
  // `discontinuous`: since the last call; nothing fades then. Asserts that ticks do not go back.
  std::span<const float> at(std::uint64_t tick, double tick_s, const ModeMap* map, std::span<const Vec3f> displacement,
                            std::size_t mode_count, bool discontinuous);
  // The last result, and its tick.
  [[nodiscard]] std::span<const float> shown() const { return last_.coefficients; }
  [[nodiscard]] std::uint64_t tick() const { return last_.tick; }

 private:
  struct Sample {
    std::uint64_t tick = 0;
    std::vector<float> coefficients;  // empty: none
  };
  void begin_fade(std::uint64_t tick, std::span<const float> next);

  Sample last_, before_;     // as they were shown
  std::vector<float> next_;  // scratch
  const ModeMap* map_ = nullptr;
  std::vector<float> fading_;  // at the switch; empty: nothing fades
  std::uint64_t faded_from_ = 0;
};

}  // namespace hairnet::server
