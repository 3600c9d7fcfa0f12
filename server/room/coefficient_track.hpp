#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/modes/mode_map.hpp"

namespace hairnet::server {

// The hair of a character on its level, as coefficients of the groom's modes. Without coefficients the hair is at rest.
struct HairMotion {
  // The map of the level whose lattice gave the coefficients; null: a network of learnt hair gave them.
  const ModeMap* map = nullptr;
  // The first coefficients of the groom's basis, in m; the others are 0.
  std::span<const float> coefficients = {};
};

// The coefficients of one character's hair from tick to tick. Each level has its own solution, so at a change of the
// level the coefficients jump. The track adds the difference back and fades it out within 0.4 s, so that hair never
// jumps. A teleport is not faded: there the jump is right. Tick thread and workers.
class CoefficientTrack {
 public:
  // Takes the hair's motion at a tick, and returns the coefficients to show: those of the motion, plus what is left of
  // a fade. The result has as many coefficients as the motion or the fade; the others of the basis, which has
  // `mode_count`, are 0. `discontinuous`: a teleport or reset lies between the last call and this one, so nothing
  // fades. Asserts that `tick` is not before that of the last call. The result is valid until the next call.
  std::span<const float> at(std::uint64_t tick, double tick_s, const HairMotion& motion, std::size_t mode_count,
                            bool discontinuous);
  // The last result, and its tick.
  [[nodiscard]] std::span<const float> shown() const { return last_.coefficients; }
  [[nodiscard]] std::uint64_t tick() const { return last_.tick; }
  // Whether a fade was part of the last result.
  [[nodiscard]] bool is_fading() const { return !fading_.empty(); }

 private:
  struct Sample {
    std::uint64_t tick = 0;
    // The first coefficients of the basis; the others are 0.
    std::vector<float> coefficients;
  };
  // Begins a fade from the shown hair to `next`, the coefficients of the new level.
  void begin_fade(std::uint64_t tick, std::span<const float> next);

  // The last result, and the one before, as they were returned.
  Sample last_, before_;
  // before_ was shown, and the hair went on from it without a gap or a teleport: the two samples give a speed.
  bool has_before_ = false;
  // The number of modes of the last basis; zero: at() was not called yet.
  std::size_t mode_count_ = 0;
  // A buffer of at().
  std::vector<float> next_;
  // The map of the last motion, and whether a network gave it.
  const ModeMap* map_ = nullptr;
  bool was_learnt_ = false;
  // The jump of the coefficients at the last change of level, which fades from the tick faded_from_ on; empty: nothing
  // fades.
  std::vector<float> fading_;
  std::uint64_t faded_from_ = 0;
};

}  // namespace hairnet::server
