#include "client/viewer/sources/local_world.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hairnet::viewer {
namespace {

constexpr double kCatchUpMax_s = 0.1;  // a machine that is too slow shows slow motion
constexpr double kTimeRounding_s = 1e-9;

bool has_level(const LevelSet& levels, LevelIndex level) {
  return level == LevelIndex::rigid || !levels[level].rest.empty();
}

// Nothing is learnt here: who asks for that gets low, as from a server.
LevelIndex here(LevelIndex wanted) {
  return wanted == LevelIndex::learnt ? LevelIndex::low : wanted;
}

}  // namespace

WorldDef LocalWorld::world_def(const Def& def) {
  WorldDef world;
  world.tick_s = 1 / def.tick_rate_hz;
  world.environment.wind = WindField(def.wind);
  world.now_ns = def.clock_ns;
  return world;
}

LocalWorld::LocalWorld(const Def& def) : def_(def), world_(world_def(def)) {}

std::uint64_t LocalWorld::add(LocalCharacter character) {
  auto simulated = std::make_unique<SimulatedCharacter>(std::move(character), def_.duration_s, def_.loop);
  simulated->id = next_id_++;
  if (simulated->def.material)
    simulated->material = scale_between(simulated->def.groom->materials.base, *simulated->def.material);
  CharacterDef def;
  def.pose = rounded_to_wire(pose_of(*simulated, tick_time_s(tick_)));
  simulated->character = world_.add(def);
  world_.set_material(simulated->character, simulated->material);
  simulated_.push_back(std::move(simulated));
  show();
  return simulated_.back()->id;
}

void LocalWorld::remove_all() {
  simulated_.clear();
  world_ = World(world_def(def_));
  start_s_ = shown_s_ = -MotionTimeline::kLeadIn_s;
  start_tick_ = tick_ = 0;
  show();
}

void LocalWorld::give_levels(const Groom& groom, const std::shared_ptr<const LevelSet>& levels) {
  for (const auto& simulated : simulated_) {
    if (simulated->def.groom.get() != &groom || simulated->levels) continue;
    simulated->levels = levels;
    world_.set_level_set(simulated->character, levels);
    set_level_now(*simulated);
  }
}

void LocalWorld::set_level_now(SimulatedCharacter& simulated) {
  const LevelIndex level = here(simulated.level_wanted);
  if (simulated.levels && has_level(*simulated.levels, level)) world_.set_level(simulated.character, level);
}

std::vector<std::shared_ptr<const Groom>> LocalWorld::grooms_without_levels() const {
  std::vector<std::shared_ptr<const Groom>> grooms;
  for (const auto& simulated : simulated_) {
    if (!simulated->levels && std::find(grooms.begin(), grooms.end(), simulated->def.groom) == grooms.end())
      grooms.push_back(simulated->def.groom);
  }
  return grooms;
}

double LocalWorld::tick_time_s(std::uint64_t tick) const {
  return start_s_ + static_cast<double>(tick - start_tick_) / def_.tick_rate_hz;
}

Pose LocalWorld::pose_of(const SimulatedCharacter& simulated, double time_s) const {
  Place place = simulated.def.place;
  if (simulated.aside) place.x_m += kAside_m;
  return simulated.grab.apply(placed(place, simulated.timeline.at(time_s)), simulated.def.groom->body);
}

void LocalWorld::tick() {
  const double from_s = tick_time_s(tick_), to_s = tick_time_s(++tick_);
  for (const auto& simulated : simulated_) {
    const bool teleport =
        std::exchange(simulated->teleport_pending, false) || simulated->timeline.teleports(from_s, to_s);
    world_.set_pose(simulated->character, rounded_to_wire(pose_of(*simulated, to_s)), teleport);
  }
  const std::int64_t began_ns = def_.clock_ns != nullptr ? def_.clock_ns() : 0;
  LocalTick done{tick_, to_s, world_.step(), 0};
  if (def_.clock_ns != nullptr) done.step_ms = 1e-6 * static_cast<double>(def_.clock_ns() - began_ns);
  ticks_.push_back(done);
  for (const auto& simulated : simulated_) take_lattice(*simulated);
  if (on_tick_) on_tick_();
}

void LocalWorld::take_lattice(SimulatedCharacter& simulated) {
  std::swap(simulated.before, simulated.after);
  const LatticeView view = world_.lattice(simulated.character);
  Lattice& after = simulated.after;
  after.level = view.level;
  after.displacement.assign(view.displacement.begin(), view.displacement.end());
  if (view.model == nullptr) {
    after.geometry = nullptr;
  } else if (after.geometry.get() != &view.model->geometry) {
    after.geometry = {simulated.levels, &view.model->geometry};
  }
}

void LocalWorld::advance_to(double time_s) {
  ticks_.clear();
  shown_s_ = std::max(shown_s_, time_s);
  while (tick_time_s(tick_) < shown_s_ - kTimeRounding_s) tick();
  show();
}

double LocalWorld::tick_end_s() const {
  const double end_s = tick_time_s(tick_);
  return end_s > shown_s_ + kTimeRounding_s ? end_s : tick_time_s(tick_ + 1);
}

void LocalWorld::step_once() {
  advance_to(tick_end_s());
}

Result<void> LocalWorld::advance(std::int64_t now_ns) {
  const double elapsed_s =
      std::clamp(1e-9 * static_cast<double>(now_ns - last_ns_.value_or(now_ns)), 0.0, kCatchUpMax_s);
  last_ns_ = now_ns;
  for (const auto& simulated : simulated_) simulated->grab.advance(elapsed_s);
  advance_to(paused_ ? shown_s_ : shown_s_ + speed_ * elapsed_s);
  return {};
}

void LocalWorld::set_tick_rate(double hz) {
  if (hz == def_.tick_rate_hz) return;
  start_s_ = tick_time_s(tick_);
  def_.tick_rate_hz = hz;
  start_tick_ = tick_;
  World next(world_def(def_));
  for (const auto& simulated : simulated_) {
    CharacterDef def;
    const LatticeView view = world_.lattice(simulated->character);
    def.levels = simulated->levels;
    def.level = view.level;
    def.pose = *view.pose;
    const CharacterId id = next.add(def);
    next.set_material(id, simulated->material);
    const LatticeState& state = world_.state(simulated->character);
    if (view.level != LevelIndex::rigid) next.set_state(id, state.displacement, state.velocity);
    simulated->character = id;
    set_level_now(*simulated);
  }
  world_ = std::move(next);
  for (const auto& simulated : simulated_) take_lattice(*simulated);
}

std::optional<LatticeView> LocalWorld::lattice(std::uint64_t id) const {
  for (const auto& simulated : simulated_) {
    if (simulated->id == id) return world_.lattice(simulated->character);
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
  if (simulated == nullptr || !validate(scale).empty()) return;
  simulated->material = scale;
  world_.set_material(simulated->character, scale);
}

void LocalWorld::set_level(std::uint64_t id, LevelIndex level) {
  SimulatedCharacter* simulated = find(id);
  if (simulated == nullptr) return;
  simulated->level_wanted = level;
  set_level_now(*simulated);
}

void LocalWorld::teleport(std::uint64_t id) {
  SimulatedCharacter* simulated = find(id);
  if (simulated == nullptr) return;
  simulated->aside = !simulated->aside;
  simulated->teleport_pending = true;
}

void LocalWorld::set_wind(const Wind& wind) {
  if (!validate(wind).empty()) return;
  def_.wind = wind;
  world_.set_environment({Environment{}.gravity, WindField(wind)});
}

void LocalWorld::show() {
  viewed_.resize(simulated_.size());
  for (std::size_t i = 0; i < simulated_.size(); ++i) show(*simulated_[i], viewed_[i]);
}

void LocalWorld::show(SimulatedCharacter& simulated, ViewedCharacter& character) {
  // Across a change of lattice, shows the old one until the new one's time.
  const double into = 1 - (tick_time_s(tick_) - shown_s_) * def_.tick_rate_hz;
  const auto share = static_cast<float>(std::clamp(into, 0.0, 1.0));
  const bool joined = simulated.before.geometry == simulated.after.geometry;
  const Lattice& lattice = joined || share >= 1 ? simulated.after : simulated.before;
  simulated.shown = lattice.displacement;
  if (joined && share < 1) {
    for (std::size_t i = 0; i < simulated.shown.size(); ++i)
      simulated.shown[i] = (1 - share) * simulated.before.displacement[i] + share * simulated.after.displacement[i];
  }
  if (!simulated.shown.empty()) {
    simulated.grid.resize(lattice.geometry->lattice.node_count());
    expand_displacements(*lattice.geometry, simulated.shown, simulated.grid);
  }

  character = {};
  character.id = simulated.id;
  character.name = simulated.def.name;
  character.groom = simulated.def.groom;
  character.hair_colour = simulated.def.hair_colour;
  character.pose = pose_of(simulated, shown_s_);
  if (!simulated.shown.empty()) character.lattice = {lattice.geometry.get(), simulated.grid};
  character.level = lattice.level;
  character.geometry = lattice.geometry;
  character.displacement = simulated.shown;
  if (lattice.geometry && simulated.levels) character.model = {simulated.levels, &(*simulated.levels)[lattice.level]};
  if (character.model) character.skin = character.model->skin;
  character.material = simulated.material;
  character.level_wanted = simulated.level_wanted;
  character.own = true;
}

}  // namespace hairnet::viewer
