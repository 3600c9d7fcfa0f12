#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"
#include "core/parallel_for.hpp"
#include "core/solver/step.hpp"
#include "core/touch/touch_body.hpp"
#include "core/touch/touch_rule.hpp"
#include "core/world/character.hpp"
#include "core/world/grab.hpp"
#include "core/world/step_cost.hpp"

namespace hairnet {

// Names a character of one World. Ids are values: copies stay valid until the character is removed, and name nothing
// afterwards.
struct CharacterId {
  std::uint32_t slot = 0;
  // Zero means null.
  std::uint32_t generation = 0;
  friend bool operator==(const CharacterId&, const CharacterId&) = default;
  explicit operator bool() const { return generation != 0; }
};

// What a world is made with; nothing of it can change later, but environments can (World::set_environment).
struct WorldDef {
  double tick_s = 1.0 / 30;
  // Zero means substep_count_for(tick_s); poses are interpolated within the tick.
  int substep_count = 0;
  // The iterations of conjugate gradient in a substep; zero means iterations_for.
  int iterations = 0;
  std::uint32_t character_count_max = 65536;
  // The environment of every index that no set_environment call has set.
  Environment environment;
  // Null means that steps are not timed (StepReport::costs).
  ClockNs now_ns = nullptr;
  // Empty means one after the other.
  ParallelFor parallel_for;
};

// What a new character starts with.
struct CharacterDef {
  // Null means that only the rigid level can be set.
  std::shared_ptr<const LevelSet> levels;
  LevelIndex level = LevelIndex::rigid;
  Pose pose;
  std::uint32_t environment = 0;
  // The toucher that owns the character (TouchRule).
  ToucherId owner = kRoomToucher;
};

// The most environments, of which each room of a server has its own.
inline constexpr std::uint32_t kEnvironmentCountMax = 65536;

// An entry of World::set_levels().
struct LevelChange {
  CharacterId id;
  LevelIndex level = LevelIndex::rigid;
};

// What one tick did, as counts of characters unless stated otherwise.
struct StepReport {
  // Characters whose lattice or network was stepped in this tick.
  std::uint32_t stepped = 0;
  std::uint32_t teleports = 0;
  // Lattices that were not finite and returned to rest.
  std::uint32_t lattices_reset = 0;
  // Characters that are asleep and were not stepped.
  std::uint32_t asleep = 0;
  // Characters with a stride whose next turn is in a later tick.
  std::uint32_t waiting = 0;
  // Suspended characters.
  std::uint32_t suspended = 0;
  // Characters that hands or props are near, or whose hair is held or pinned.
  std::uint32_t touched = 0;
  // Pairs of a character and a body of its room whose touch the character's rule forbids, near or far.
  std::uint32_t bodies_refused = 0;
  // Pairs of a character and a near body that came after the nearest kStepBodiesMax.
  std::uint32_t bodies_left_out = 0;
  // Hands that lost their hair, because the hand has gone or the hair was stretched too far.
  std::uint32_t holds_ended = 0;
  // The costs of stepping. Times are measured only with WorldDef::now_ns.
  StepCosts costs;
};

// The hair of one character, as frames and FFD need it. Valid until the next change of the world.
struct LatticeView {
  LevelIndex level = LevelIndex::rigid;
  // The lattice model; null on the learnt and the rigid level.
  const Level* model = nullptr;
  // The displacements of the active nodes in head space, m; empty without a lattice.
  std::span<const Vec3f> displacement;
  // The first coefficients of the groom's basis, m; empty unless learnt.
  std::span<const float> coefficients;
  // The network was trained on such motions as those of the last step.
  bool is_covered = true;
  // The last step ended at this pose.
  const Pose* pose = nullptr;
  // Nothing changed in the last tick, and nothing changes until the character wakes.
  bool asleep = false;
  // The pose or the lattice changed in the last tick.
  bool stepped = false;
  // The last change was a teleport, the end of a suspension or a reset: do not interpolate to it.
  bool discontinuous = false;
  // A hand or a prop was near in the last tick, or holds the hair.
  bool is_touched = false;
};

// The simulated characters. One thread at a time may call it; asserts that no call comes while step() runs.
// Deterministic: the same calls give the same bits for any parallel_for. It owns the states of all characters and
// shares their levels. It samples no poses, reads no clock and chooses no level: callers decide these, so that a
// recording of the calls repeats the run.
class World {
 public:
  // Asserts that the tick has a length, and finite gravity.
  explicit World(const WorldDef& def);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  // Returns a null id when full. Asserts a valid pose, and an environment below kEnvironmentCountMax.
  [[nodiscard]] CharacterId add(const CharacterDef& def);
  // Unknown ids are ignored.
  void remove(CharacterId id);
  // The pose at the end of the next step. `teleport`: the lattice moves rigidly with the head, and keeps its velocity
  // relative to the head. A jump of the head (is_teleport) is treated as a teleport too. Asserts that `pose` is valid.
  void set_pose(CharacterId id, const Pose& pose, bool teleport = false);
  // A lattice of the same nodes (built with another material) keeps its state, any other starts at rest.
  void set_level_set(CharacterId id, std::shared_ptr<const LevelSet> levels);
  // Transfers the state to the new level by least squares (LevelSet::maps). The transferred state strains the new
  // springs and may put nodes inside the body, so stiffness and contact fade in over kSwitchEase_s. For the rigid level
  // the displacements fade out over kRigidEase_s, and the old level stays until then. The learnt level has no
  // common state with lattices: it begins as if the pose had been held, ends at rest, and needs ticks of kLearntTick_s.
  // Returns false when the character has no such level.
  bool set_level(CharacterId id, LevelIndex level);
  // Does what set_level() does for each change in turn, on the threads of `parallel_for`.
  void set_levels(std::span<const LevelChange> changes);
  // The character's own material from the next step on. Asserts that it is valid.
  void set_material(CharacterId id, const MaterialScale& material);
  // Sets the environment of the characters with that index; from the next step on. Asserts that the index is below
  // kEnvironmentCountMax and gravity is finite.
  void set_environment(std::uint32_t index, const Environment& environment);
  void set_environment(const Environment& environment) { set_environment(0, environment); }
  // A character of stride 2 or 4 is stepped every second or fourth tick, over all of these ticks at once: from the
  // pose of its last step to the newest. Between these ticks its lattice and pose do not change. Its slot decides
  // which ticks, so that the characters of one stride spread over them. New characters have stride 1. Asserts a
  // stride of 1, 2 or 4.
  void set_stride(CharacterId id, int stride);
  // A suspended character is not stepped and costs nothing; for characters that nobody sees. When the suspension ends,
  // the lattice moves rigidly with the head to the newest pose in the next tick, as after a teleport. The hair then
  // continues with the velocity relative to the head that it had before.
  void set_suspended(CharacterId id, bool suspended);
  // Replaces the lattice state on the present level. Displacements and velocities are those of LatticeState. With no
  // velocities, or when one exceeds 25 m/s as on a ride, the hair moves with the head.
  //
  // Returns false and changes nothing when the character is unknown or has no lattice, when it eases to the rigid
  // level, or when a value is not valid. Values are valid when the counts are the level's, all numbers are finite, no
  // node is further from its design than the level allows, and none is faster than 1000 m/s.
  bool set_state(CharacterId id, std::span<const Vec3f> displacement, std::span<const Vec3f> velocity);
  // Replaces the bodies in the rooms of that environment; each moves in the next step from where the one with its key
  // was, and then stays. Asserts that the bodies are valid, and their keys ascend.
  void set_bodies(std::uint32_t environment, std::span<const TouchBody> bodies);
  // Sets who may touch the character's hair, from the next step on. Those who hold hair and may not any more lose it.
  // New characters have the default rule. Asserts that TouchRule::chosen ascends.
  void set_touch_rule(CharacterId id, const TouchRule& rule);
  // Takes hold of hair from the next step on, and returns how many contact points are held: 0 when the hand's body is
  // not there, may not touch, or is too far away, and for hair without a lattice. A hand that holds hair of the
  // character already lets go of it first. At most kStepHoldsMax points of a character are held, the nearest first.
  // Asserts a finite place and a radius up to kGrabRadiusMax_m.
  std::uint32_t grab(CharacterId id, const Grab& grab);
  // Does nothing when that hand holds nothing of it.
  void let_go(CharacterId id, const TouchKey& hand, Release release);
  // Exactly one tick. A character whose bones and hair have been still for kSleepAfter_s falls asleep and is not
  // stepped until its pose, its level, its material or the environment changes; any wind keeps all awake.
  StepReport step();

  [[nodiscard]] bool contains(CharacterId id) const;
  [[nodiscard]] std::size_t character_count() const;
  // Both assert contains(id).
  [[nodiscard]] LatticeView lattice(CharacterId id) const;
  [[nodiscard]] const LatticeState& state(CharacterId id) const;
  // How many points of the character's hair that hand holds, without pins; 0 for unknown ids.
  [[nodiscard]] std::uint32_t held_count(CharacterId id, const TouchKey& hand) const;
  // One number for the state of all live characters and bodies, in order of slots, to compare two runs tick by tick. It
  // leaves out touch rules, the timers of untangling and the poses that learnt hair remembers.
  [[nodiscard]] std::uint64_t hash() const;

 private:
  struct Impl;
  // The implementation. Asserts that no step() runs.
  [[nodiscard]] Impl& between_steps() const;

  std::unique_ptr<Impl> impl_;
};

}  // namespace hairnet
