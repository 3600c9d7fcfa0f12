#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/modes/mode_map.hpp"

namespace hairnet::server {

// The hair of a character on its level, as coefficients of the groom's modes. An empty one is hair at rest.
struct HairMotion {
  // Belongs to the lattice's level, where the coefficients are from; null: they are from a network.
  const ModeMap* map = nullptr;
  // These are the first of the groom's basis, in m; the others are 0.
  std::span<const float> coefficients = {};
};

// The coefficients of one character's hair from tick to tick. Each level has its own solution, so at a change of the
// level the coefficients jump. The track adds the difference back and fades it out within 0.4 s, so that hair never
// jumps. A teleport is not faded: there the jump is right. Tick thread and workers.
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

  // These are as they were shown.
  Sample last_, before_;
  // before_ was shown, and the hair went on from it without a gap or a teleport: the two samples give a speed.
  bool has_before_ = false;
  // Belongs to the last basis; zero: nothing was shown.
  std::size_t mode_count_ = 0;
  std::vector<float> next_;
  // This and the next belong to the last motion.
  const ModeMap* map_ = nullptr;
  bool was_learnt_ = false;
  // The difference that the switch made, which fades; empty: nothing fades.
  std::vector<float> fading_;
  std::uint64_t faded_from_ = 0;
};

}  // namespace hairnet::server
