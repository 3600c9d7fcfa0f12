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

// On the way to the rigid level displacements fade out over this time. Without it, hair would jump to its design.
inline constexpr double kRigidEase_s = 0.3;
// Springs and contact fade in over this time after a level switch. The transferred state strains the new springs and
// may put nodes inside the body, so at full strength both would kick the hair.
inline constexpr double kSwitchEase_s = 0.5;
// A character falls asleep when its bones and hair have been still for this long.
inline constexpr double kSleepAfter_s = 4.5;
// Hair settles (settle() in character.cpp) when bones and air have been at rest for this long.
inline constexpr double kSettleAfter_s = 8;
// Hair near props or still hands, or with pins, settles sooner, because what lies on a chair would creep meanwhile.
inline constexpr double kSettleTouchedAfter_s = 2;
// The changed_tick of a character that has had no turn yet: no tick has this number.
inline constexpr std::uint64_t kNeverChanged = ~0ull;

// What a character on the learnt level remembers from turn to turn.
struct LearntTurn {
  LearntState state;
  // The coefficients that the network drives, m.
  std::vector<float> coefficients;
  // Whether the network has had a turn since the character came to the learnt level.
  bool has_begun = false;
  // The network was trained on motions such as those of the last turn.
  bool is_covered = true;
};

// One character of a world: its hair's state, its poses, and the clocks that decide about stepping, easing, settling
// and sleep. A Character belongs to one World; within a tick one thread at a time uses it.
struct Character {
  std::shared_ptr<const LevelSet> levels;
  // The level on which the character is. While it eases to the rigid level this is still the old one.
  LevelIndex level = LevelIndex::rigid;
  // The state of the lattice; empty on levels without one.
  LatticeState state;
  // The network's state; empty on other levels.
  LearntTurn learnt;
  MaterialScale material;
  // The room of the character, an index into TickContext::environments.
  std::uint32_t environment = 0;
  // The hands of this toucher may touch the hair when nobody else may.
  ToucherId owner = kRoomToucher;
  TouchRule touch_rule;
  // What touches the hair; null while no body is near and nobody holds or has pinned any.
  std::unique_ptr<CharacterTouch> touch;
  // The pose `from` belongs to the state, at state_tick. The pose `to` is the newest, and the next turn moves to it.
  Pose from, to;
  // The pose at which the last substep began. Together with `from` it gives the rigid velocity (rigid_velocity.hpp).
  Pose last_from;
  // The length of that substep, s.
  double last_step_s = 0;
  // The mean velocity of the head over the last turn, world, m/s. With it is_teleport() tells a ride from a jump.
  Vec3 head_velocity = Vec3::Zero();
  // The pose near which the bones have stayed for bones_still_s.
  Pose still_pose;
  double bones_still_s = 0;
  // How long bones and hair have been still. From kSleepAfter_s on the character is asleep.
  double still_s = 0;
  // The time since the rigid level was requested, s; negative while the character does not ease to it.
  double rigid_ease_s = -1;
  // The time since the last level switch, s. The default means that there was none.
  double since_switch_s = 1e9;
  // The factor of springs and attachments in the last turn, and the share of contact that was switched off. Both come
  // from level switches and untangling (ease_in in character.cpp).
  double stiffness = 1;
  double contact_release = 0;
  Untangle untangle;
  // The state before the last turn, while the hair settles; otherwise unused.
  LatticeState unsettled;
  // The tick up to which the state has been stepped: it includes all ticks before this one.
  std::uint64_t state_tick = 0;
  // The state_tick after the last turn in which the character was not asleep.
  std::uint64_t changed_tick = kNeverChanged;
  // Shifts the character's turns among the ticks: it has a turn when tick + phase is a multiple of the stride.
  std::uint32_t phase = 0;
  // The ticks from turn to turn: 1, 2 or 4 (World::set_stride).
  std::uint8_t stride = 1;
  // The ticks that the last turn covered. A turn between two regular ones, as after touch, covers fewer than the
  // stride.
  std::uint8_t step_ticks = 1;
  // The character has no turns (World::set_suspended).
  bool suspended = false;
  // The character has a turn in the next tick, whatever its phase.
  bool steps_next_tick = false;
  // The next turn is a teleport, as its caller has said (World::set_pose).
  bool teleport = false;
  // The last turn was a teleport or a reset, so nobody may interpolate across it.
  bool discontinuous = false;
  // The velocities in `state` lack the rigid velocity, which is not known yet after a jump. The next turn adds it.
  bool velocity_is_relative = false;

  // The level's lattice; null on the learnt and the rigid level.
  [[nodiscard]] const Level* model() const { return has_lattice(level) && levels ? &(*levels)[level] : nullptr; }
  // The network; null except on the learnt level.
  [[nodiscard]] const LearntHair* network() const {
    return level == LevelIndex::learnt ? levels->learnt.get() : nullptr;
  }
  [[nodiscard]] bool is_asleep() const { return still_s >= kSleepAfter_s; }
  void wake() { still_s = 0; }
};

// Asserts what holds between all calls below: the state fits the level, numbers are in range, and ticks do not go back.
void check_invariants(const Character& character);

// What all characters of a tick share. The World owns what it points to, for the length of the tick.
struct TickContext {
  double tick_s = 0;
  std::span<const Environment> environments;
  const StepPlans* plans = nullptr;
  // The number of the tick that is stepped; the time at its end is (tick + 1) tick_s.
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

// Does everything of a tick before the stepping: finds out whether the character has a turn, teleports or sleeps, and
// eases it to the rigid level. After Outcome::stepped the caller must step the lattice or the network; after any other
// outcome the character's tick is done. Asserts that the character is not suspended and had no turn in this tick.
Outcome begin_tick(const TickContext& terms, Character& character);

// Makes the inputs of the substeps in a character's turn, without touch (put_touch adds it). Call it between begin_tick
// and the stepping. Asserts that there is one input for each substep of the character's plan.
void put_inputs(const TickContext& terms, const Character& character, std::span<StepInput> inputs);

// Ends the turn of a lattice after its last substep: settles hair and counts its stillness. `inputs`: those of
// put_inputs. When `is_finite` is false, the lattice returns to rest. Asserts that the character has a lattice.
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
