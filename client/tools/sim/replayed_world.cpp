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

// Sixteen digits, as logs of servers show hashes.
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
  // A second header would change the rate in the middle.
  if (simulation_) return Refusal("a second header");
  // The World asserts these, and a damaged file must end in an error instead.
  if (header.tick_rate_hz < 1 || header.tick_rate_hz > 1000 || header.substep_count < 1 || header.iterations < 0)
    return Refusal("the header's rate, substeps or iterations are out of range");
  rate_hz_ = header.tick_rate_hz;
  WorldDef def;
  def.tick_s = 1.0 / header.tick_rate_hz;
  def.substep_count = header.substep_count;
  def.iterations = header.iterations;
  // WorldDef is asserted by the World: what a file says must be checked here first.
  def.environment.gravity = Vec3(header.gravity.data());
  if (!def.environment.gravity.allFinite()) return Refusal("the header's gravity is not finite");
  if (const std::string error = validate(header.wind); !error.empty()) return Refusal("the header's " + error);
  simulation_.emplace(def, header.wind);
  return {};
}

Result<void> ReplayedWorld::take(const wire::RecordedGroom& recorded) {
  Result<Groom> groom = wire::decode_groom(recorded.bytes);
  if (!groom) return Refusal("a groom: " + groom.error());
  RecordedLevels& levels = grooms_[wire::hash_groom(recorded.bytes)];
  // A groom that comes twice has the same bytes; its levels may be built from it already.
  if (!levels.levels) levels.groom = std::move(*groom);
  return {};
}

Result<void> ReplayedWorld::take(const wire::RecordedLearnt& recorded) {
  const auto found = grooms_.find(recorded.groom);
  if (found == grooms_.end()) return Refusal("learnt hair of a groom that is not in the recording");
  // The next use of the groom's levels makes a new set with it.
  found->second.learnt = recorded.hair;
  return {};
}

const Groom* ReplayedWorld::groom(CharacterKey character) const {
  const auto found = grooms_.find(characters_.at(character));
  // A character may have a groom that the recording does not hold, as long as it is rigid.
  return found == grooms_.end() ? nullptr : &found->second.groom;
}

const LevelGeometry* ReplayedWorld::lattice_of(CharacterKey character) const {
  const LatticeView view = simulation_->lattice(character);
  // Learnt hair is a sum of modes on the finest level's lattice.
  if (view.level == LevelIndex::learnt)
    return &(*grooms_.at(characters_.at(character)).levels)[LevelIndex::high].geometry;
  return view.model == nullptr ? nullptr : &view.model->geometry;
}

std::span<const Vec3f> ReplayedWorld::displacement(CharacterKey character, std::vector<Vec3f>& scratch) const {
  const LatticeView view = simulation_->lattice(character);
  if (view.level != LevelIndex::learnt) return view.displacement;
  const Basis& basis = grooms_.at(characters_.at(character)).levels->modes->basis;
  scratch.resize(basis.node_count);
  displacements_of(basis, view.coefficients, scratch);
  return scratch;
}

Result<std::shared_ptr<const LevelSet>> ReplayedWorld::levels_of(const wire::GroomHash& hash) {
  const auto found = grooms_.find(hash);
  if (found == grooms_.end()) return Refusal("a groom that is not in the recording");
  RecordedLevels& recorded = found->second;
  // Building takes seconds, and many grooms of a recording are never simulated.
  if (!recorded.levels) {
    if (recorded.groom.points.empty()) return Refusal("levels of a groom without strand points");
    BuildCallbacks callbacks;
    callbacks.progress = [this](double fraction, std::string_view stage) {
      progress_(fraction, stage);
      return true;
    };
    recorded.levels = build_levels(recorded.groom, callbacks);
  }
  // The set is shared with the World, so it is not changed but replaced.
  if (recorded.levels->learnt != recorded.learnt) {
    auto levels = std::make_shared<LevelSet>(*recorded.levels);
    levels->learnt = recorded.learnt;
    // Modes are needed for learnt hair alone.
    if (!levels->modes) levels->modes = make_modes(recorded.groom, recorded.levels);
    recorded.levels = std::move(levels);
  }
  return recorded.levels;
}

Result<void> ReplayedWorld::give_levels(const wire::GroomHash& groom, LevelIndex level) {
  Result<std::shared_ptr<const LevelSet>> levels = levels_of(groom);
  if (!levels) return Refusal(levels.error());
  // An empty level is one that was not built.
  const bool lacks = level == LevelIndex::learnt  ? !(*levels)->learnt
                     : level != LevelIndex::rigid ? (**levels)[level].rest.empty()
                                                  : false;
  if (lacks) return Refusal("a level that the groom does not have");
  // The levels are there before the tick that uses them, as on the server.
  simulation_->put_levels(groom, std::move(*levels));
  return {};
}

Result<void> ReplayedWorld::is_known(CharacterKey character, const char* what) const {
  if (characters_.contains(character)) return {};
  return Refusal(what + (" unknown " + name_of(character)));
}

Result<void> ReplayedWorld::prepare(const wire::RecordedAdd& added) {
  const std::string name = name_of(added.character);
  if (characters_.contains(added.character)) return Refusal("adds " + name + " twice");
  // These are asserted by the World, so a damaged file must be refused here.
  if (added.room >= kEnvironmentCountMax) return Refusal("adds " + name + " to a room beyond the bound");
  if (!is_valid(added.pose)) return Refusal("adds " + name + " with an invalid pose");
  // The server adds hair rigid until its levels are built.
  if (!added.levels_ready && added.level != LevelIndex::rigid)
    return Refusal("adds " + name + " at a level that is not built");
  characters_[added.character] = added.groom;
  return added.levels_ready ? give_levels(added.groom, added.level) : Result<void>();
}

Result<void> ReplayedWorld::prepare(const wire::RecordedLevel& level) {
  if (Result<void> known = is_known(level.character, "sets the level of"); !known) return known;
  if (level.level == LevelIndex::rigid) return {};
  return give_levels(characters_.at(level.character), level.level);
}

// Checks the inputs of a tick, and has the levels that they need. The order is that of Simulation::step, so that a
// character that one list removes is unknown to the next ones. After an error the world is not stepped any more.
Result<void> ReplayedWorld::prepare(const wire::RecordedTick& tick) {
  for (const CharacterKey character : tick.removed) {
    if (Result<void> known = is_known(character, "removes"); !known) return known;
    characters_.erase(character);
  }
  for (const wire::RecordedAdd& added : tick.added) {
    if (Result<void> prepared = prepare(added); !prepared) return prepared;
  }
  for (const wire::RecordedLevel& level : tick.levels) {
    if (Result<void> prepared = prepare(level); !prepared) return prepared;
  }
  for (const wire::RecordedMaterial& change : tick.materials) {
    if (Result<void> known = is_known(change.character, "sets the material of"); !known) return known;
    if (const std::string error = validate(change.scale); !error.empty()) return Refusal(error);
  }
  for (const wire::RecordedStride& change : tick.strides) {
    if (Result<void> known = is_known(change.character, "sets the stride of"); !known) return known;
  }
  for (const wire::RecordedSuspension& change : tick.suspensions) {
    if (Result<void> known = is_known(change.character, "suspends"); !known) return known;
  }
  for (const wire::RecordedState& state : tick.states) {
    if (Result<void> known = is_known(state.character, "sets the state of"); !known) return known;
  }
  for (const wire::RecordedWind& change : tick.winds) {
    if (const std::string error = validate(change.wind); !error.empty()) return Refusal(error);
    if (change.room >= kEnvironmentCountMax) return Refusal("a room of too high an index");
  }
  for (const wire::RecordedPose& pose : tick.poses) {
    if (Result<void> known = is_known(pose.character, "poses"); !known) return known;
    if (!is_valid(pose.pose)) return Refusal("an invalid pose of " + name_of(pose.character));
  }
  return {};
}

Result<void> ReplayedWorld::take(const wire::RecordedTick& tick) {
  // The header has the rate, without which there is no world.
  if (!simulation_) return Refusal("a tick before the header");
  const auto at_tick = [&](const std::string& what) {
    return Refusal("tick " + std::to_string(tick.tick) + ": " + what);
  };
  if (const Result<void> prepared = prepare(tick); !prepared) return at_tick(prepared.error());
  simulation_->step(tick);
  // Simulation::step ignores additions beyond the limit, which must not pass as equal.
  if (simulation_->character_count() != characters_.size()) return at_tick("more characters than a world holds");
  // The hash covers all live state of all characters, bit by bit.
  if (simulation_->hash() != tick.state_hash)
    return at_tick("the state differs: hash " + hex(simulation_->hash()) + ", recorded " + hex(tick.state_hash));
  return {};
}

}  // namespace hairnet::sim
