#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/world/simulation_inputs.hpp"
#include "core/world/world.hpp"

namespace hairnet {

// A World that takes recorded inputs only. The live server and a replay call the same function with the same inputs,
// and so get the same bits. It names characters by keys and grooms by hashes, which recordings can hold, while the
// World's ids and pointers mean nothing in another process. One thread uses it.
class Simulation {
 public:
  // `wind` replaces def's wind for rooms without their own; it must pass validate().
  explicit Simulation(const WorldDef& def, const Wind& wind = {});

  // Sets the levels of a groom, by its hash, from now on. Asserts that they are not null.
  void put_levels(const GroomHash& groom, std::shared_ptr<const LevelSet> levels);
  // Characters that have these levels keep them.
  void forget_levels(const GroomHash& groom);
  [[nodiscard]] std::shared_ptr<const LevelSet> levels(const GroomHash& groom) const;
  [[nodiscard]] bool has_levels(const GroomHash& groom) const { return levels_.contains(groom); }
  // The learnt hair of the groom; null while it has none.
  [[nodiscard]] const LearntHair* learnt(const GroomHash& groom) const {
    const auto found = levels_.find(groom);
    return found == levels_.end() ? nullptr : found->second->learnt.get();
  }

  // Applies the inputs of a tick and steps the World. The order is: removed, added, levels, materials, strides,
  // suspensions, states, winds, poses, touch rules, bodies, releases, grabs. Ignores inputs for unknown characters, and
  // additions beyond the world's limit.
  StepReport step(const SimulationInputs& inputs);

  [[nodiscard]] bool contains(CharacterKey key) const { return characters_.contains(key); }
  // Asserts contains(key).
  [[nodiscard]] LatticeView lattice(CharacterKey key) const;
  // Returns the velocities of the lattice's nodes, head space, m/s.
  [[nodiscard]] std::span<const Vec3f> velocity(CharacterKey key) const;
  // Characters whose SimulationInputs::State the World refused in the last step (World::set_state).
  [[nodiscard]] const std::vector<CharacterKey>& hair_states_refused() const { return hair_states_refused_; }
  // How many contact points each of the last step's grabs holds; 0 for unknown characters.
  [[nodiscard]] const std::vector<std::uint32_t>& held_counts() const { return held_counts_; }
  // How many points of the character's hair that hand holds after the last step, without pins; 0 for unknown
  // characters.
  [[nodiscard]] std::uint32_t held_count(CharacterKey key, const TouchKey& hand) const {
    return world_.held_count(id_of(key), hand);
  }
  [[nodiscard]] std::uint64_t hash() const { return world_.hash(); }
  [[nodiscard]] std::size_t character_count() const { return characters_.size(); }

 private:
  // A character of the World, and which of its groom's data it has got so far.
  struct Placed {
    CharacterId id;
    GroomHash groom{};
    bool has_levels = false, has_learnt = false;
  };
  void add(const SimulationInputs::Add& added);
  void set_levels(std::span<const SimulationInputs::Level> changes);

  // Applies touch rules, bodies, releases and grabs, in this order.
  void set_touch(const SimulationInputs& inputs);
  // The World's id of a character; null for unknown ones.
  [[nodiscard]] CharacterId id_of(CharacterKey key) const;
  void set_wind(std::uint32_t room, const Wind& wind);

  // The gravity of all rooms. Its wind is replaced before each use, since every room has its own.
  Environment environment_;
  World world_;
  std::unordered_map<CharacterKey, Placed> characters_;
  std::map<GroomHash, std::shared_ptr<const LevelSet>> levels_;
  std::vector<CharacterKey> hair_states_refused_;
  std::vector<std::uint32_t> held_counts_;
  // A buffer for the level changes of one tick.
  std::vector<LevelChange> level_changes_;
};

}  // namespace hairnet
