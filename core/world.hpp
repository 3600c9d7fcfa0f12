#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/build/level.hpp"
#include "core/groom/groom.hpp"
#include "core/parallel_for.hpp"
#include "core/solver/step.hpp"
#include "core/world/character.hpp"

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
  Environment environment;
  ParallelFor parallel_for;  // empty: one after the other
};

struct CharacterDef {
  std::shared_ptr<const LevelSet> levels;  // null: only the rigid level can be set
  LevelIndex level = LevelIndex::rigid;
  Pose pose;
};

struct StepReport {
  std::uint32_t stepped = 0;  // characters with a lattice
  std::uint32_t teleports = 0;
  std::uint32_t lattices_reset = 0;  // a non-finite lattice returned to rest
  std::uint32_t asleep = 0;          // characters at rest that were not stepped
};

// A character's lattice as frames and FFD need it. Valid until the world changes.
struct LatticeView {
  LevelIndex level = LevelIndex::rigid;
  const Level* model = nullptr;         // null when rigid
  std::span<const Vec3f> displacement;  // active order, head space, m; empty when rigid
  const Pose* pose = nullptr;           // the one the last step ended at
  bool asleep = false;                  // nothing of this has changed since the last tick, nor will it before it wakes
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
  // too large to simulate (is_teleport). Must be valid.
  void set_pose(CharacterId id, const Pose& pose, bool teleport = false);
  // A lattice of the same nodes (built with another material) keeps its state, any other starts at rest.
  void set_levels(CharacterId id, std::shared_ptr<const LevelSet> levels);
  // The state is carried over by least squares (LevelSet::maps). Its springs are then strained and
  // its nodes inside the body where the old level's were not: stiffness and contact come in over kSwitchEase_s. Into
  // the rigid level the lattice is eased over kRigidEase_s, and keeps its old level until then. False when that level
  // is not there.
  bool set_level(CharacterId id, LevelIndex level);
  void set_material(CharacterId id, const MaterialScale& material);  // must be valid; from the next step on
  void set_environment(const Environment& environment);              // of all; from the next step on
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
