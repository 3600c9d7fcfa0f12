#include "client/viewer/sources/local_world.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hairnet::viewer {
namespace {

// One call of advance() advances the world by at most this time, so a machine that is too slow shows slow motion.
// Catching up would take even longer for the next picture, and never end.
constexpr double kCatchUpMax_s = 0.1;
}  // namespace

LocalWorld::LocalWorld(const Def& def) : def_(def) {
  begin();
}

// A new world for each start: ticks count from 1, and the lead-in lets hair settle.
void LocalWorld::begin() {
  local::PlayedWorld::Def def;
  def.tick_rate_hz = def_.tick_rate_hz;
  def.start_s = -MotionTimeline::kLeadIn_s;
  def.wind = def_.wind;
  def.clock_ns = def_.clock_ns;
  // Only what does not move may be captured: this object is returned by value from local_world_of.
  played_ = std::make_unique<local::PlayedWorld>(def);
  ticks_->number = 0;
  played_->on_tick([ticks = ticks_.get()](double end_s, const StepReport& report, double step_ms) {
    ticks->last.push_back({++ticks->number, end_s, report, step_ms});
    if (ticks->call) ticks->call();
  });
  // Touch outlives remove_all(), so it is set again.
  played_->touch_by(bodies_);
}

std::uint64_t LocalWorld::add(LocalCharacter character) {
  simulated_.push_back(std::make_unique<SimulatedCharacter>(std::move(character), def_.duration_s, def_.loop));
  SimulatedCharacter& simulated = *simulated_.back();
  simulated.id = next_id_++;
  // The character is owned by a pointer, so the reference stays good in the callback.
  simulated.played = played_->add([&simulated](double from_s, double to_s) {
    // The played world also asks for the pose to show, with two equal times. Such a call must not use up a pending
    // jump, which is for the next tick.
    const bool is_tick = to_s > from_s;
    const bool jumps =
        is_tick && (std::exchange(simulated.teleport_pending, false) || simulated.timeline.teleports(from_s, to_s));
    return local::TickPose{pose_of(simulated, to_s), jumps};
  });
  if (simulated.def.material)
    simulated.material = scale_between(simulated.def.groom->materials.base, *simulated.def.material);
  played_->set_material(simulated.played, simulated.material);
  played_->set_level(simulated.played, simulated.level_wanted);
  show();
  return simulated.id;
}

void LocalWorld::remove_all() {
  simulated_.clear();
  // Rate and wind are the user's choice, and outlive the characters.
  def_.tick_rate_hz = played_->tick_rate_hz();
  def_.wind = played_->wind();
  begin();
  show();
}

void LocalWorld::give_levels(const Groom& groom, const std::shared_ptr<const LevelSet>& levels) {
  for (const auto& simulated : simulated_) {
    if (simulated->def.groom.get() != &groom || simulated->has_levels) continue;
    simulated->has_levels = true;
    played_->give_levels(simulated->played, levels);
  }
}

std::vector<std::shared_ptr<const Groom>> LocalWorld::grooms_without_levels() const {
  std::vector<std::shared_ptr<const Groom>> grooms;
  for (const auto& simulated : simulated_) {
    if (!simulated->has_levels && std::find(grooms.begin(), grooms.end(), simulated->def.groom) == grooms.end())
      grooms.push_back(simulated->def.groom);
  }
  return grooms;
}

Pose LocalWorld::pose_of(const SimulatedCharacter& simulated, double time_s) {
  Place place = simulated.def.place;
  // The grab comes last: it offsets the motion at the place where the character stands.
  if (simulated.aside) place.x_m += kAside_m;
  return simulated.grab.apply(placed(place, simulated.timeline.at(time_s)), simulated.def.groom->body);
}

void LocalWorld::touch_by(BodiesAt bodies) {
  bodies_ = std::move(bodies);
  played_->touch_by(bodies_);
}

std::uint32_t LocalWorld::take_hair(std::uint64_t id, const Grab& grab) {
  const SimulatedCharacter* simulated = find(id);
  return simulated != nullptr ? played_->grab(simulated->played, grab) : 0;
}

void LocalWorld::let_go_of_hair(std::uint64_t id, const TouchKey& hand, Release release) {
  const SimulatedCharacter* simulated = find(id);
  if (simulated != nullptr) played_->let_go(simulated->played, hand, release);
}

void LocalWorld::advance_to(double time_s) {
  // A call may make several ticks, or none between two ticks.
  ticks_->last.clear();
  played_->advance_to(time_s);
  show();
}

void LocalWorld::step_once() {
  advance_to(tick_end_s());
}

Result<void> LocalWorld::advance(std::int64_t now_ns) {
  // The first call and a clock that goes back advance nothing.
  const double elapsed_s =
      std::clamp(1e-9 * static_cast<double>(now_ns - last_ns_.value_or(now_ns)), 0.0, kCatchUpMax_s);
  last_ns_ = now_ns;
  for (const auto& simulated : simulated_) simulated->grab.advance(elapsed_s);
  // Also when paused the world is asked for this moment: a grabbed head still moves, and its hair waits.
  advance_to(paused_ ? time_s() : time_s() + speed_ * elapsed_s);
  return {};
}

std::optional<LatticeView> LocalWorld::lattice(std::uint64_t id) const {
  for (const auto& simulated : simulated_) {
    if (simulated->id == id) return played_->lattice(simulated->played);
  }
  return {};
}

LocalWorld::SimulatedCharacter* LocalWorld::find(std::uint64_t id) {
  const auto found =
      std::find_if(simulated_.begin(), simulated_.end(), [id](const auto& simulated) { return simulated->id == id; });
  return found == simulated_.end() ? nullptr : found->get();
}

HeadGrab* LocalWorld::grab(std::uint64_t id) {
  SimulatedCharacter* simulated = find(id);
  return simulated != nullptr ? &simulated->grab : nullptr;
}

void LocalWorld::set_material(std::uint64_t id, const MaterialScale& scale) {
  SimulatedCharacter* simulated = find(id);
  // A slider may be in the middle of an edit: an invalid scale changes nothing.
  if (simulated == nullptr || !validate(scale).empty()) return;
  simulated->material = scale;
  played_->set_material(simulated->played, scale);
}

void LocalWorld::set_level(std::uint64_t id, LevelIndex level) {
  SimulatedCharacter* simulated = find(id);
  if (simulated == nullptr) return;
  simulated->level_wanted = level;
  played_->set_level(simulated->played, level);
}

void LocalWorld::teleport(std::uint64_t id) {
  SimulatedCharacter* simulated = find(id);
  if (simulated == nullptr) return;
  simulated->aside = !simulated->aside;
  simulated->teleport_pending = true;
}

void LocalWorld::set_wind(const Wind& wind) {
  if (!validate(wind).empty()) return;
  played_->set_wind(wind);
}

void LocalWorld::show() {
  // The list is rebuilt for each picture, since spans of the last one are no longer valid.
  viewed_.clear();
  for (const auto& simulated : simulated_) {
    const local::PlayedWorld::Shown shown = played_->shown(simulated->played);
    ViewedCharacter& character = viewed_.emplace_back();
    character.id = simulated->id;
    character.name = simulated->def.name;
    character.groom = simulated->def.groom;
    character.hair_colour = simulated->def.hair_colour;
    character.pose = shown.pose;
    character.lattice = shown.lattice;
    character.level = shown.level;
    character.geometry = shown.geometry;
    character.displacement = shown.displacement;
    character.model = shown.model;
    // The skin is that of the level: without a level hair rests, and needs none.
    if (character.model) character.skin = character.model->skin;
    character.material = simulated->material;
    character.level_wanted = simulated->level_wanted;
    character.own = true;
  }
}

}  // namespace hairnet::viewer
