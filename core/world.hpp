#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/build/level.hpp"
#include "core/groom/groom.hpp"
#include "core/parallel_for.hpp"
#include "core/solver/step.hpp"
#include "core/world/character.hpp"
#include "core/world/step_cost.hpp"

namespace hairnet {

struct CharacterId {
  std::uint32_t slot = 0;
  std::uint32_t generation = 0;  // zero is null
  friend bool operator==(const CharacterId&, const CharacterId&) = default;
  explicit operator bool() const { return generation != 0; }
};

struct WorldDef {
  double tick_s = 1.0 / 30;
  int substep_count = 0;  // 0: substep_count_for(tick_s); poses are interpolated within the tick
  int iterations = 0;     // of conjugate gradient a step; 0: iterations_for
  std::uint32_t character_count_max = 65536;
  Environment environment;   // of every index that set_environment has not set
  ClockNs now_ns = nullptr;  // null: steps are not timed (StepReport::costs)
  ParallelFor parallel_for;  // empty: one after the other
};

struct CharacterDef {
  std::shared_ptr<const LevelSet> levels;  // null: only the rigid level can be set
  LevelIndex level = LevelIndex::rigid;
  Pose pose;
  std::uint32_t environment = 0;  // which one blows about it
};

inline constexpr std::uint32_t kEnvironmentCountMax = 65536;

struct StepReport {
  std::uint32_t stepped = 0;  // characters with a lattice whose turn it was
  std::uint32_t teleports = 0;
  std::uint32_t lattices_reset = 0;  // a non-finite lattice returned to rest
  std::uint32_t asleep = 0;          // characters at rest that were not stepped
  std::uint32_t waiting = 0;         // for their turn
  std::uint32_t held = 0;
  StepCosts costs;  // times only with WorldDef::now_ns
};

// A character's lattice as frames and FFD need it. Valid until the world changes.
struct LatticeView {
  LevelIndex level = LevelIndex::rigid;
  const Level* model = nullptr;         // null when rigid
  std::span<const Vec3f> displacement;  // active order, head space, m; empty when rigid
  const Pose* pose = nullptr;           // the one the last step ended at
  bool asleep = false;                  // nothing of this has changed since the last tick, nor will it before it wakes
  bool stepped = false;                 // its turn was in the last tick: pose or lattice changed
  bool jumped = false;                  // in its last turn: a teleport, a release or a reset, no motion to be shown
};

// All characters. One thread at a time; closed while step() runs. Deterministic: the same calls give the same bits for
// any parallel_for.
class World {
 public:
  explicit World(const WorldDef& def);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  [[nodiscard]] CharacterId add(const CharacterDef& def);  // null id when full
  void remove(CharacterId id);                             // unknown ids are ignored
  // The pose at the end of the next step. `teleport`: the lattice moves rigidly with the head. Also taken for one when
  // too large to simulate over the ticks since its last turn (is_teleport). Must be valid.
  void set_pose(CharacterId id, const Pose& pose, bool teleport = false);
  // A lattice of the same nodes (built with another material) keeps its state, any other starts at rest.
  void set_levels(CharacterId id, std::shared_ptr<const LevelSet> levels);
  // The state is carried over by least squares (LevelSet::maps). Its springs are then strained and
  // its nodes inside the body where the old level's were not: stiffness and contact come in over kSwitchEase_s. Into
  // the rigid level the lattice is eased over kRigidEase_s, and keeps its old level until then. False when that level
  // is not there.
  bool set_level(CharacterId id, LevelIndex level);
  void set_material(CharacterId id, const MaterialScale& material);  // must be valid; from the next step on
  // Of the characters of that index, below kEnvironmentCountMax; from the next step on.
  void set_environment(std::uint32_t index, const Environment& environment);
  void set_environment(const Environment& environment) { set_environment(0, environment); }
  // A character of stride 2 or 4 has a turn every second or fourth tick, in which it is carried over all of them at
  // once, from the pose of its last turn to the newest; between, its lattice and pose stay as they were. Its slot says
  // in which ticks, so that those of one stride spread over them. New characters have stride 1.
  void set_stride(CharacterId id, int stride);
  // One that is held, since nobody sees it, is not stepped and costs nothing. Released, it moves rigidly with the head
  // to the newest pose in the next tick, as by a teleport, and goes on as its hair moved against the head when held.
  void set_held(CharacterId id, bool held);
  // The lattice's state on the present level, as state() has it; without velocities hair moves with the head. False,
  // and nothing is changed, when the counts are not the level's, a number is not finite, a node is further from its
  // design than the level lets it, or faster than 100 m/s.
  bool set_state(CharacterId id, std::span<const Vec3f> displacement, std::span<const Vec3f> velocity);
  // Exactly one tick. A character whose bones and hair have been still for kSleepAfter_s falls asleep and is not
  // stepped until its pose, its level, its material or the environment changes; any wind keeps all awake.
  StepReport step();

  [[nodiscard]] bool contains(CharacterId id) const;
  [[nodiscard]] std::size_t character_count() const;
  [[nodiscard]] LatticeView lattice(CharacterId id) const;  // contains(id) must hold
  [[nodiscard]] const LatticeState& state(CharacterId id) const;
  [[nodiscard]] std::uint64_t hash() const;  // all live state, in order of slots

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hairnet
