#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/assert.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "core/levels/level.hpp"
#include "core/solver/step.hpp"
#include "core/touch/touch_rule.hpp"
#include "core/world/character_touch.hpp"
#include "core/world/step_plan.hpp"
#include "core/world/untangle.hpp"

namespace hairnet {

// Displacements fade out in this time on the way to the rigid level: at once, hair would jump.
inline constexpr double kRigidEase_s = 0.3;
// Springs and contact fade in over this time after a level switch, since the mapped state strains the new springs and
// may put nodes inside the body.
inline constexpr double kSwitchEase_s = 0.5;
// Bones and hair have been still for so long before a character falls asleep.
inline constexpr double kSleepAfter_s = 4.5;
// Hair settles after bones and air have rested for so long.
inline constexpr double kSettleAfter_s = 8;
// No tick has this number.
inline constexpr std::uint64_t kNeverChanged = ~0ull;

// Hair on the learnt level.
struct LearntTurn {
  LearntState state;
  // Holds the coefficients that the network drives, m.
  std::vector<float> coefficients;
  bool has_begun = false;
  // Training covered its last turn.
  bool is_covered = true;
};

// One character of a world: its hair's state, its poses, and the clocks that decide about stepping, easing, settling
// and sleep. A Character belongs to one World; within a tick one thread at a time uses it.
struct Character {
  std::shared_ptr<const LevelSet> levels;
  LevelIndex level = LevelIndex::rigid;
  // Is empty without a lattice.
  LatticeState state;
  // Is empty on other levels.
  LearntTurn learnt;
  MaterialScale material;
  std::uint32_t environment = 0;
  // The hands of this toucher may touch the hair when nobody else may.
  ToucherId owner = kRoomToucher;
  TouchRule touch_rule;
  // Is null while nothing is near the hair and nobody holds it.
  std::unique_ptr<CharacterTouch> touch;
  // The state belongs to `from`, the pose at state_tick; `to` is the newest.
  Pose from, to;
  // The last substep began at this pose: with `from` it gives the rigid velocity.
  Pose last_from;
  // Is the length of that substep.
  double last_step_s = 0;
  // Is taken over its last turn, world, m/s: tells a ride from a jump (is_teleport).
  Vec3 head_velocity = Vec3::Zero();
  // The bones have stayed near it for bones_still_s.
  Pose still_pose;
  double bones_still_s = 0;
  // Bones and hair have been still for so long; from kSleepAfter_s on the character is asleep.
  double still_s = 0;
  // Is the time since the rigid level was requested; negative means not requested.
  double rigid_ease_s = -1;
  // Is the time since the last level switch.
  double since_switch_s = 1e9;
  // Is the factor of the last tick from the level switch and untangling.
  double stiffness = 1;
  double contact_release = 0;
  Untangle untangle;
  // Holds the state before its last turn, while it settles.
  LatticeState unsettled;
  // Counts the ticks that the state includes.
  std::uint64_t state_tick = 0;
  // Is state_tick when it last changed.
  std::uint64_t changed_tick = kNeverChanged;
  // Shifts its turns: the character has a turn when tick + phase is a multiple of the stride.
  std::uint32_t phase = 0;
  // Is 1, 2 or 4.
  std::uint8_t stride = 1;
  // Counts the ticks of its last turn.
  std::uint8_t step_ticks = 1;
  // Says that the character has no turns.
  bool suspended = false;
  // Says that the character has a turn in the next tick, independent of the phase.
  bool steps_next_tick = false;
  // Is requested for the next turn.
  bool teleport = false;
  // Applies to its last turn.
  bool discontinuous = false;
  // Velocities are relative to the rest's motion, which is not known yet.
  bool velocity_is_relative = false;

  [[nodiscard]] const Level* model() const { return has_lattice(level) && levels ? &(*levels)[level] : nullptr; }
  [[nodiscard]] const LearntHair* network() const {
    return level == LevelIndex::learnt ? levels->learnt.get() : nullptr;
  }
  [[nodiscard]] bool is_asleep() const { return still_s >= kSleepAfter_s; }
  void wake() { still_s = 0; }
};

// Asserts what holds between all calls below: the state fits the level, numbers are in range, and ticks do not go back.
void check_invariants(const Character& character);

// Data that all characters of a tick share.
struct TickContext {
  double tick_s = 0;
  std::span<const Environment> environments;
  const StepPlans* plans = nullptr;
  std::uint64_t tick = 0;

  [[nodiscard]] const StepPlan& plan(const Character& c) const {
    HAIRNET_ASSERT(plans);
    return plans->of(c.level, c.step_ticks);
  }
  [[nodiscard]] const Environment& environment(const Character& c) const {
    HAIRNET_ASSERT(c.environment < environments.size());
    return environments[c.environment];
  }
};

// What a tick did to a character. `waiting`: its turn comes later. `idle`: it is rigid. `stepped`: its lattice or
// network moved. `eased`: its displacement fades on the way to the rigid level. `teleport`: the hair moved rigidly with
// the head. `reset`: the lattice was not finite and is in its design again. `asleep`: nothing changed.
enum class Outcome : std::uint8_t { waiting, idle, stepped, eased, teleport, reset, asleep };

// Everything of a tick before the stepping. `waiting`: it is not the character's turn. `stepped`: the lattice or the
// network must be stepped; otherwise the character's tick is done. Asserts that the character is not suspended and had
// no turn in this tick.
Outcome begin_tick(const TickContext& terms, Character& character);

// Makes the inputs of the steps in a character's turn, without touch; asserts that there is one for each substep of its
// plan.
void put_inputs(const TickContext& terms, const Character& character, std::span<StepInput> inputs);

// Call it after the last step. A lattice that is not finite returns to rest. Asserts that the character has a lattice.
Outcome end_tick(const TickContext& terms, std::span<const StepInput> inputs, bool is_finite, Character& character);

// Steps the networks of at most kLearntWidth characters through their turns, and ends their ticks. All have the same
// network and step over the same number of ticks.
void step_learnt_turns(const TickContext& terms, std::span<Character* const> characters);

// A suspended character, which no observer sees, has no turns. When it is resumed, it moves rigidly with the head to
// the newest pose in the next tick, `tick`, and then continues with its hair's velocity relative to the head. Each
// asserts that it changes something.
void suspend(Character& character);
void unsuspend(std::uint64_t tick, Character& character);

// Replaces the lattice state on the current level, see World::set_state. Returns false and changes nothing when the
// state is not valid.
bool replace_state(std::span<const Vec3f> displacement, std::span<const Vec3f> velocity, Character& character);

}  // namespace hairnet
