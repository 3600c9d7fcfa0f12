#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/modes/mode_map.hpp"

namespace hairnet::server {

// The hair of a character on its level. Nothing: it is at rest.
struct HairMotion {
  const ModeMap* map = nullptr;              // of the lattice's level, where the coefficients are from; none: a network
  std::span<const float> coefficients = {};  // of the groom's basis, the first, m; the others are 0
};

// The coefficients of one character's hair from tick to tick. When the level changes, they come from elsewhere: the
// difference that the change makes is added back and fades out, so that hair never jumps. Tick thread and workers.
class CoefficientTrack {
 public:
  // As many first coefficients as the motion or a fade has, at a later tick, or the same; the others of the basis,
  // which has `mode_count`, are 0. `discontinuous`: since the last call; nothing fades then. Asserts that ticks do not
  // go back.
  std::span<const float> at(std::uint64_t tick, double tick_s, const HairMotion& motion, std::size_t mode_count,
                            bool discontinuous);
  // The last result, and its tick.
  [[nodiscard]] std::span<const float> shown() const { return last_.coefficients; }
  [[nodiscard]] std::uint64_t tick() const { return last_.tick; }
  [[nodiscard]] bool is_fading() const { return !fading_.empty(); }  // at the last result

 private:
  struct Sample {
    std::uint64_t tick = 0;
    std::vector<float> coefficients;  // the others are 0
  };
  void begin_fade(std::uint64_t tick, std::span<const float> next);

  Sample last_, before_;          // as they were shown
  bool has_before_ = false;       // and the hair went on from it
  std::size_t mode_count_ = 0;    // of the last basis; 0: nothing was shown
  std::vector<float> next_;       // scratch
  const ModeMap* map_ = nullptr;  // this and the next: of the last motion
  bool was_learnt_ = false;
  std::vector<float> fading_;  // at the switch; empty: nothing fades
  std::uint64_t faded_from_ = 0;
};

}  // namespace hairnet::server
