#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/levels/level.hpp"
#include "core/solver/step.hpp"
#include "core/world/step_plan.hpp"
#include "core/world/untangle.hpp"

namespace hairnet {

inline constexpr double kRigidEase_s = 0.3;
inline constexpr double kSwitchEase_s = 0.5;
inline constexpr double kSleepAfter_s = 4.5;

// One character of a world.
struct Character {
  std::shared_ptr<const LevelSet> levels;
  LevelIndex level = LevelIndex::rigid;
  LatticeState state;  // empty when rigid
  MaterialScale material;
  std::uint32_t environment = 0;
  Pose from, to;                // `from`: at state_tick, where the state stands; `to`: the newest
  Pose last_from;               // where the last substep began: with `from` it gives the rest velocity
  double last_step_s = 0;       // the length of that substep
  Pose still_pose;              // the bones have not left it for bones_still_s
  double bones_still_s = 0;     // how long
  double still_s = 0;           // and hair as well; with kSleepAfter_s asleep
  double rigid_ease_s = -1;     // since the rigid level was asked for; negative: it was not
  double since_switch_s = 1e9;  // since the lattice was carried over from another level
  double stiffness = 1;         // what the switch and untangling left of it in the last tick
  double contact_release = 0;
  Untangle untangle;
  std::uint64_t state_tick = 0;        // ticks that the state has behind it
  std::uint64_t changed_tick = ~0ull;  // state_tick when it last changed
  std::uint32_t phase = 0;             // of its turns: it has one when tick + phase is a multiple of the stride
  std::uint8_t stride = 1;             // 1, 2 or 4
  std::uint8_t step_ticks = 1;         // of its last turn
  bool suspended = false;              // has no turns
  bool steps_next_tick = false;        // has one in the next tick, whatever the phase
  bool teleport = false;               // asked for
  bool discontinuous = false;          // in its last turn
  bool velocity_is_relative = false;   // velocities are less the rest's, whose motion is not known yet

  [[nodiscard]] const Level* model() const {
    return level == LevelIndex::rigid || !levels ? nullptr : &(*levels)[level];
  }
  [[nodiscard]] bool is_asleep() const { return still_s >= kSleepAfter_s; }
  void wake() { still_s = 0; }
};

// What every character of a tick shares.
struct TickContext {
  double tick_s = 0;
  std::span<const Environment> environments;
  const StepPlans* plans = nullptr;
  std::uint64_t tick = 0;

  [[nodiscard]] const StepPlan& plan(const Character& c) const { return plans->of(c.level, c.step_ticks); }
  [[nodiscard]] const Environment& environment(const Character& c) const { return environments[c.environment]; }
};

enum class Outcome : std::uint8_t { waiting, idle, stepped, eased, teleport, reset, asleep };

// All of a tick but the stepping. `waiting`: it is not the character's turn. `stepped`: the lattice is to be stepped;
// else the character's tick is done.
Outcome begin_tick(const TickContext& terms, Character& character);

// The steps of the turn of a character to be stepped; as many as its plan's substeps.
void put_inputs(const TickContext& terms, const Character& character, std::span<StepInput> inputs);

// After the last of them. A lattice that is not finite returns to rest.
Outcome end_tick(const TickContext& terms, std::span<const StepInput> inputs, bool is_finite, Character& character);

// A character nobody sees has no turns. Released, it moves rigidly with the head to the newest pose in the next tick,
// `tick`, and then goes on with the velocity that its hair had against the head.
void suspend(Character& character);
void unsuspend(std::uint64_t tick, Character& character);

// Another lattice state on the present level, as World::set_state takes it. False and nothing done when it is not
// sound.
bool replace_state(std::span<const Vec3f> displacement, std::span<const Vec3f> velocity, Character& character);

}  // namespace hairnet
