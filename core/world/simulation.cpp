#include "core/world/simulation.hpp"

#include <utility>

#include "core/assert.hpp"

namespace hairnet {

Simulation::Simulation(const WorldDef& def, const Wind& wind)
    : environment_(def.environment), world_([&] {
        WorldDef windy = def;
        windy.environment.wind = WindField(wind);
        return windy;
      }()) {}

void Simulation::set_wind(std::uint32_t room, const Wind& wind) {
  HAIRNET_ASSERT(room < kEnvironmentCountMax);
  HAIRNET_VALIDATE(validate(wind).empty());
  environment_.wind = WindField(wind);
  world_.set_environment(room, environment_);
}

void Simulation::put_levels(const GroomHash& groom, std::shared_ptr<const LevelSet> levels) {
  HAIRNET_ASSERT(levels);
  levels_[groom] = std::move(levels);
}

void Simulation::forget_levels(const GroomHash& groom) {
  levels_.erase(groom);
}

std::shared_ptr<const LevelSet> Simulation::levels(const GroomHash& groom) const {
  const auto found = levels_.find(groom);
  return found == levels_.end() ? nullptr : found->second;
}

StepReport Simulation::step(const SimulationInputs& inputs) {
  // The order is part of the recording's meaning. Removals come first, so a key may return in the same tick. Levels
  // come before states, which fit one level. Rules and bodies come before grabs, which need both.
  for (const CharacterKey key : inputs.removed) {
    const auto placed = characters_.find(key);
    if (placed == characters_.end()) continue;
    world_.remove(placed->second.id);
    characters_.erase(placed);
  }
  for (const SimulationInputs::Add& added : inputs.added) add(added);
  set_levels(inputs.levels);
  for (const SimulationInputs::Material& change : inputs.materials) {
    const auto placed = characters_.find(change.character);
    if (placed != characters_.end()) world_.set_material(placed->second.id, change.scale);
  }
  for (const SimulationInputs::Stride& change : inputs.strides) {
    const auto placed = characters_.find(change.character);
    if (placed != characters_.end()) world_.set_stride(placed->second.id, change.stride);
  }
  for (const SimulationInputs::Suspension& change : inputs.suspensions) {
    const auto placed = characters_.find(change.character);
    if (placed != characters_.end()) world_.set_suspended(placed->second.id, change.suspended);
  }
  hair_states_refused_.clear();
  for (const SimulationInputs::State& state : inputs.states) {
    const auto placed = characters_.find(state.character);
    if (placed == characters_.end()) continue;
    if (!world_.set_state(placed->second.id, state.displacements, state.velocities))
      hair_states_refused_.push_back(state.character);
  }
  for (const SimulationInputs::RoomWind& change : inputs.winds) set_wind(change.room, change.wind);
  for (const SimulationInputs::BonePose& pose : inputs.poses) {
    const auto placed = characters_.find(pose.character);
    if (placed != characters_.end()) world_.set_pose(placed->second.id, pose.pose, pose.teleport);
  }
  set_touch(inputs);
  HAIRNET_ASSERT(world_.character_count() == characters_.size());
  return world_.step();
}

CharacterId Simulation::id_of(CharacterKey key) const {
  const auto placed = characters_.find(key);
  return placed == characters_.end() ? CharacterId{} : placed->second.id;
}

void Simulation::set_touch(const SimulationInputs& inputs) {
  for (const SimulationInputs::Rule& change : inputs.touch_rules)
    world_.set_touch_rule(id_of(change.character), change.rule);
  for (const SimulationInputs::RoomBodies& change : inputs.bodies) world_.set_bodies(change.room, change.bodies);
  // Releases come before grabs, so a hand can let go and take hold again in one tick.
  for (const SimulationInputs::LetGo& release : inputs.releases)
    world_.let_go(id_of(release.character), release.hand, release.release);
  held_counts_.clear();
  for (const SimulationInputs::TakeHold& take : inputs.grabs)
    held_counts_.push_back(world_.grab(id_of(take.character), take.grab));
}

void Simulation::add(const SimulationInputs::Add& added) {
  HAIRNET_ASSERT(added.room < kEnvironmentCountMax);
  // A key that is taken keeps its character.
  if (characters_.contains(added.character)) return;
  CharacterDef def;
  // Whether the levels were ready is an input too: in a replay they may be ready earlier than they were in the live
  // run.
  if (added.levels_ready) def.levels = levels(added.groom);
  // Without levels nothing but the rigid level exists.
  def.level = def.levels ? added.level : LevelIndex::rigid;
  def.pose = added.pose;
  def.environment = added.room;
  def.owner = added.owner;
  const bool has_levels = def.levels != nullptr, has_learnt = has_levels && def.levels->learnt;
  const CharacterId id = world_.add(def);
  if (id) characters_[added.character] = {id, added.groom, has_levels, has_learnt};
}

void Simulation::set_levels(std::span<const SimulationInputs::Level> changes) {
  level_changes_.clear();
  for (const SimulationInputs::Level& change : changes) {
    const auto placed = characters_.find(change.character);
    if (placed == characters_.end()) continue;
    Placed& character = placed->second;
    // A character may be older than its groom's levels, and than its learnt hair. It gets them when a level change
    // first asks for them.
    if (!character.has_levels || (change.level == LevelIndex::learnt && !character.has_learnt)) {
      auto set = levels(character.groom);
      if (!set) continue;
      character.has_levels = true;
      character.has_learnt = set->learnt != nullptr;
      world_.set_level_set(character.id, std::move(set));
    }
    level_changes_.push_back({character.id, change.level});
  }
  world_.set_levels(level_changes_);
}

std::span<const Vec3f> Simulation::velocity(CharacterKey key) const {
  HAIRNET_ASSERT(contains(key));
  return world_.state(characters_.at(key).id).velocity;
}

LatticeView Simulation::lattice(CharacterKey key) const {
  HAIRNET_ASSERT(contains(key));
  return world_.lattice(characters_.at(key).id);
}

}  // namespace hairnet
