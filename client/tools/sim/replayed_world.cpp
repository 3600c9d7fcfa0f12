#include "client/tools/sim/replayed_world.hpp"

#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet::sim {
namespace {

std::string hex(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, value);
  return text;
}

// "session 7 character 3": the name of a recording's character in messages.
std::string name_of(std::uint64_t character) {
  return "session " + std::to_string(character >> 32) + " character " + std::to_string(character & 0xffffffff);
}

}  // namespace

Result<void> ReplayedWorld::take(const wire::RecordingHeader& header) {
  if (world_) return Refusal("a second header");
  if (header.tick_rate_hz < 1 || header.tick_rate_hz > 1000 || header.substep_count < 1 || header.iterations < 0)
    return Refusal("the header's rate, substeps or iterations are out of range");
  WorldDef def;
  def.tick_s = tick_s_ = 1.0 / header.tick_rate_hz;
  def.substep_count = header.substep_count;
  def.iterations = header.iterations;
  def.environment.gravity = Vec3(header.gravity.data());
  if (!def.environment.gravity.allFinite()) return Refusal("the header's gravity is not finite");
  if (const std::string fault = validate(header.wind); !fault.empty()) return Refusal("the header's " + fault);
  def.environment.wind = WindField(header.wind);
  environment_ = def.environment;
  world_.emplace(def);
  return {};
}

Result<void> ReplayedWorld::take(const wire::RecordedGroom& recorded) {
  Result<Groom> groom = wire::decode_groom(recorded.bytes);
  if (!groom) return Refusal("a groom: " + groom.error());
  RecordedLevels& levels = grooms_[wire::hash_groom(recorded.bytes)];
  if (!levels.levels) levels.groom = std::move(*groom);
  return {};
}

Result<void> ReplayedWorld::take(const wire::RecordedLearnt& recorded) {
  const auto found = grooms_.find(recorded.groom);
  if (found == grooms_.end()) return Refusal("learnt hair of a groom that is not in the recording");
  found->second.learnt = recorded.hair;
  return {};
}

std::span<const Vec3f> ReplayedWorld::displacement(const Character& character, std::vector<Vec3f>& scratch) const {
  const LatticeView view = world_->lattice(character.id);
  if (view.level != LevelIndex::learnt) return view.displacement;
  const Basis& basis = grooms_.at(character.groom).levels->modes->basis;
  scratch.resize(basis.node_count);
  displacements_of(basis, view.coefficients, scratch);
  return scratch;
}

Result<std::shared_ptr<const LevelSet>> ReplayedWorld::levels_of(const wire::GroomHash& hash) {
  const auto found = grooms_.find(hash);
  if (found == grooms_.end()) return Refusal("a groom that is not in the recording");
  RecordedLevels& recorded = found->second;
  if (!recorded.levels) {
    if (recorded.groom.points.empty()) return Refusal("levels of a groom without strand points");
    BuildCallbacks callbacks;
    callbacks.progress = [this](double fraction, std::string_view stage) {
      progress_(fraction, stage);
      return true;
    };
    recorded.levels = build_levels(recorded.groom, callbacks);
  }
  if (recorded.levels->learnt != recorded.learnt) {
    auto levels = std::make_shared<LevelSet>(*recorded.levels);
    levels->learnt = recorded.learnt;
    if (!levels->modes) levels->modes = make_modes(recorded.groom, recorded.levels);
    recorded.levels = std::move(levels);
  }
  return recorded.levels;
}

Result<void> ReplayedWorld::add(const wire::RecordedAdd& added) {
  if (characters_.contains(added.character)) return Refusal("adds " + name_of(added.character) + " twice");
  if (added.room >= kEnvironmentCountMax)
    return Refusal("adds " + name_of(added.character) + " to a room beyond the bound");
  if (!is_valid(added.pose)) return Refusal("adds " + name_of(added.character) + " with an invalid pose");
  CharacterDef def;
  if (added.levels_ready) {
    Result<std::shared_ptr<const LevelSet>> levels = levels_of(added.groom);
    if (!levels) return Refusal(levels.error());
    def.levels = std::move(*levels);
  }
  if (!def.levels && added.level != LevelIndex::rigid)
    return Refusal("adds " + name_of(added.character) + " at a level that is not built");
  def.level = added.level;
  def.pose = added.pose;
  def.environment = added.room;
  const CharacterId id = world_->add(def);
  if (!id) return Refusal("more characters than a world holds");
  characters_[added.character] = {id, added.groom, added.levels_ready, def.levels && def.levels->learnt};
  return {};
}

Result<void> ReplayedWorld::set_level(const wire::RecordedLevel& level) {
  const auto found = characters_.find(level.character);
  if (found == characters_.end()) return Refusal("sets the level of unknown " + name_of(level.character));
  Character& character = found->second;
  const bool lacks_levels = !character.has_levels && level.level != LevelIndex::rigid;
  if (lacks_levels || (level.level == LevelIndex::learnt && !character.has_learnt)) {
    Result<std::shared_ptr<const LevelSet>> levels = levels_of(character.groom);
    if (!levels) return Refusal(levels.error());
    character.has_levels = true;
    character.has_learnt = (*levels)->learnt != nullptr;
    world_->set_level_set(character.id, std::move(*levels));
  }
  if (!world_->set_level(character.id, level.level))
    return Refusal("sets " + name_of(level.character) + " to a level that it does not have");
  return {};
}

Result<void> ReplayedWorld::take(const wire::RecordedTick& tick) {
  if (!world_) return Refusal("a tick before the header");
  const auto at_tick = [&](const std::string& what) {
    return Refusal("tick " + std::to_string(tick.tick) + ": " + what);
  };
  for (const std::uint64_t character : tick.removed) {
    const auto found = characters_.find(character);
    if (found == characters_.end()) return at_tick("removes unknown " + name_of(character));
    world_->remove(found->second.id);
    characters_.erase(found);
  }
  for (const wire::RecordedAdd& added : tick.added) {
    if (const Result<void> done = add(added); !done) return at_tick(done.error());
  }
  for (const wire::RecordedLevel& level : tick.levels) {
    if (const Result<void> done = set_level(level); !done) return at_tick(done.error());
  }
  for (const wire::RecordedMaterial& change : tick.materials) {
    const auto found = characters_.find(change.character);
    if (found == characters_.end()) return at_tick("sets the material of unknown " + name_of(change.character));
    if (const std::string fault = validate(change.scale); !fault.empty()) return at_tick(fault);
    world_->set_material(found->second.id, change.scale);
  }
  for (const wire::RecordedStride& change : tick.strides) {
    const auto found = characters_.find(change.character);
    if (found == characters_.end()) return at_tick("sets the stride of unknown " + name_of(change.character));
    world_->set_stride(found->second.id, change.stride);
  }
  for (const wire::RecordedSuspension& change : tick.suspensions) {
    const auto found = characters_.find(change.character);
    if (found == characters_.end()) return at_tick("suspends unknown " + name_of(change.character));
    world_->set_suspended(found->second.id, change.suspended);
  }
  for (const wire::RecordedState& state : tick.states) {
    const auto found = characters_.find(state.character);
    if (found == characters_.end()) return at_tick("sets the state of unknown " + name_of(state.character));
    // a state refused here was refused on the server too
    world_->set_state(found->second.id, state.displacements, state.velocities);
  }
  for (const wire::RecordedWind& change : tick.winds) {
    if (const std::string fault = validate(change.wind); !fault.empty()) return at_tick(fault);
    if (change.room >= kEnvironmentCountMax) return at_tick("a room of too high an index");
    environment_.wind = WindField(change.wind);
    world_->set_environment(change.room, environment_);
  }
  for (const wire::RecordedPose& pose : tick.poses) {
    const auto found = characters_.find(pose.character);
    if (found == characters_.end()) return at_tick("poses unknown " + name_of(pose.character));
    if (!is_valid(pose.pose)) return at_tick("an invalid pose of " + name_of(pose.character));
    world_->set_pose(found->second.id, pose.pose, pose.teleport);
  }
  world_->step();
  if (world_->hash() != tick.state_hash)
    return at_tick("the state differs: hash " + hex(world_->hash()) + ", recorded " + hex(tick.state_hash));
  return {};
}

}  // namespace hairnet::sim
