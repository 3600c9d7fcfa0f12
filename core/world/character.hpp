#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/build/level.hpp"
#include "core/solver/calm_release.hpp"
#include "core/solver/step.hpp"

namespace hairnet {

inline constexpr double kRigidEase_s = 0.3;
inline constexpr double kSwitchEase_s = 0.5;
inline constexpr double kSleepAfter_s = 4.5;  // after CalmRelease has done its work

// One character of a world.
struct Character {
  std::shared_ptr<const LevelSet> levels;
  LevelIndex level = LevelIndex::rigid;
  LatticeState state;  // empty when rigid
  MaterialScale material;
  Pose from, to;            // of the last tick; `from` = `to` between ticks
  Pose last_from;           // where the last substep began: with `from` it gives the rest velocity
  Pose still_pose;          // the bones have not left it for still_s
  double still_s = 0;       // with kSleepAfter_s asleep
  double easing_s = -1;     // since the rigid level was asked for; negative: it was not
  double switched_s = 1e9;  // since the lattice was carried over from another level
  double stiffness = 1;     // what calm and the switch left of it in the last tick
  double contact_release = 0;
  CalmRelease calm_release;
  bool teleport = false;

  [[nodiscard]] const Level* model() const {
    return level == LevelIndex::rigid || !levels ? nullptr : &(*levels)[level];
  }
  [[nodiscard]] bool is_asleep() const { return still_s >= kSleepAfter_s; }
  void wake() { still_s = 0; }
};

// What every character of a tick shares.
struct TickTerms {
  double tick_s = 0;
  int substep_count = 1;
  const Environment* environment = nullptr;
  std::uint64_t tick = 0;

  [[nodiscard]] double substep_s() const { return tick_s / substep_count; }
};

enum class Outcome : std::uint8_t { idle, stepped, eased, teleported, reset, asleep };

// All of a tick but the stepping. `stepped`: the lattice is to be stepped; else the character's tick is done.
Outcome begin_tick(const TickTerms& terms, Character& character);

// The steps of the tick of a character to be stepped; as many as substeps.
void put_inputs(const TickTerms& terms, const Character& character, std::span<StepInput> inputs);

// After the last of them. A lattice that is not finite returns to rest.
Outcome end_tick(const TickTerms& terms, std::span<const StepInput> inputs, bool is_finite, Character& character);

}  // namespace hairnet
