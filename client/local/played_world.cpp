#include "client/local/played_world.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet::local {
namespace {

// Sums of the caller's times differ from a tick's time by rounding. Without this tolerance a tick would be stepped one
// call too early or too late.
constexpr double kTimeRounding_s = 1e-9;

bool has_level(const LevelSet& levels, LevelIndex level) {
  return level == LevelIndex::rigid || !levels[level].rest.empty();
}

}  // namespace

WorldDef PlayedWorld::world_def(const Def& def) {
  WorldDef world;
  world.tick_s = 1 / def.tick_rate_hz;
  world.environment.wind = WindField(def.wind);
  world.now_ns = def.clock_ns;
  world.character_count_max = kCharactersMax;
  return world;
}

PlayedWorld::PlayedWorld(const Def& def)
    : def_(def), world_(world_def(def)), start_s_(def.start_s), shown_s_(def.start_s) {
  HAIRNET_ASSERT(def.tick_rate_hz >= kTickRateMin_hz && def.tick_rate_hz <= kTickRateMax_hz);
}

PlayedWorld::Id PlayedWorld::add(PoseAt pose) {
  auto simulated = std::make_unique<Simulated>();
  simulated->id = next_id_;
  simulated->pose = std::move(pose);
  CharacterDef def;
  const double now_s = tick_time_s(tick_);
  // Poses are rounded as the wire rounds them, so that this World steps the poses that a server would step.
  def.pose = rounded_to_wire(simulated->pose(now_s, now_s).pose);
  simulated->character = world_.add(def);
  // The World has no room for another character.
  if (!simulated->character) return 0;
  // Only this program has hands here, so nobody has to be kept out.
  world_.set_touch_rule(simulated->character, {TouchAudience::everyone});
  show(*simulated);
  // Numbers rise, so the list stays sorted, and at() can search by halves.
  simulated_.push_back(std::move(simulated));
  return next_id_++;
}

void PlayedWorld::remove(Id id) {
  world_.remove(at(id).character);
  std::erase_if(simulated_, [id](const auto& simulated) { return simulated->id == id; });
}

void PlayedWorld::give_levels(Id id, std::shared_ptr<const LevelSet> levels) {
  Simulated& simulated = at(id);
  simulated.levels = std::move(levels);
  world_.set_level_set(simulated.character, simulated.levels);
  set_level_now(simulated);
}

void PlayedWorld::set_level(Id id, LevelIndex level) {
  Simulated& simulated = at(id);
  // The wanted level is kept, since the levels may come later.
  simulated.level_wanted = level == LevelIndex::learnt ? LevelIndex::low : level;
  set_level_now(simulated);
}

// A level that is not there is not set: the hair stays at the one that it has.
void PlayedWorld::set_level_now(Simulated& simulated) {
  if (simulated.levels && has_level(*simulated.levels, simulated.level_wanted))
    world_.set_level(simulated.character, simulated.level_wanted);
}

void PlayedWorld::set_material(Id id, const MaterialScale& scale) {
  Simulated& simulated = at(id);
  simulated.material = scale;
  world_.set_material(simulated.character, scale);
}

void PlayedWorld::set_wind(const Wind& wind) {
  def_.wind = wind;
  world_.set_environment({Environment{}.gravity, WindField(wind)});
}

std::uint32_t PlayedWorld::grab(Id id, const Grab& grab) {
  return world_.grab(at(id).character, grab);
}

void PlayedWorld::let_go(Id id, const TouchKey& hand, Release release) {
  world_.let_go(at(id).character, hand, release);
}

double PlayedWorld::tick_time_s(std::uint64_t tick) const {
  return start_s_ + static_cast<double>(tick - start_tick_) / def_.tick_rate_hz;
}

double PlayedWorld::tick_end_s() const {
  const double end_s = tick_time_s(tick_);
  return end_s > shown_s_ + kTimeRounding_s ? end_s : tick_time_s(tick_ + 1);
}

// Steps the World by one tick. Poses and bodies are asked for in the same order each time, as the same calls must give
// the same hair.
void PlayedWorld::tick() {
  const double from_s = tick_time_s(tick_), to_s = tick_time_s(++tick_);
  for (const auto& simulated : simulated_) {
    const TickPose next = simulated->pose(from_s, to_s);
    world_.set_pose(simulated->character, rounded_to_wire(next.pose), next.teleport);
  }
  // Bodies come after the poses and before the step. All characters are in room 0.
  if (bodies_) world_.set_bodies(0, bodies_(from_s, to_s));
  const std::int64_t began_ns = def_.clock_ns != nullptr ? def_.clock_ns() : 0;
  const StepReport report = world_.step();
  const double step_ms = def_.clock_ns != nullptr ? 1e-6 * static_cast<double>(def_.clock_ns() - began_ns) : 0;
  for (const auto& simulated : simulated_) take_lattice(*simulated);
  if (on_tick_) on_tick_(to_s, report, step_ms);
}

void PlayedWorld::take_lattice(Simulated& simulated) {
  // The two lattices change places, so that their memory is used again.
  std::swap(simulated.before, simulated.after);
  const LatticeView view = world_.lattice(simulated.character);
  Lattice& after = simulated.after;
  after.level = view.level;
  after.displacement.assign(view.displacement.begin(), view.displacement.end());
  if (view.model == nullptr) {
    after.geometry = nullptr;
  } else if (after.geometry.get() != &view.model->geometry) {
    // The pointer shares the ownership of all levels: a lattice that is shown survives new levels.
    after.geometry = {simulated.levels, &view.model->geometry};
  }
}

void PlayedWorld::advance_to(double time_s) {
  // A caller's clock that goes back must not make hair go back.
  shown_s_ = std::max(shown_s_, time_s);
  // The loop leaves the last tick at or after the shown time, and the one before it at or before.
  while (tick_time_s(tick_) < shown_s_ - kTimeRounding_s) tick();
  for (const auto& simulated : simulated_) show(*simulated);
}

void PlayedWorld::set_tick_rate(double hz) {
  if (hz == def_.tick_rate_hz) return;
  start_s_ = tick_time_s(tick_);
  def_.tick_rate_hz = hz;
  // Times count from here, so that ticks before keep theirs.
  start_tick_ = tick_;
  // A World has one tick length for its life, so another rate takes a new World with the state of the old one.
  World next(world_def(def_));
  for (const auto& simulated : simulated_) {
    CharacterDef def;
    const LatticeView view = world_.lattice(simulated->character);
    def.levels = simulated->levels;
    def.level = view.level;
    def.pose = *view.pose;
    const CharacterId id = next.add(def);
    next.set_material(id, simulated->material);
    next.set_touch_rule(id, {TouchAudience::everyone});
    const LatticeState& state = world_.state(simulated->character);
    // Rigid hair has no state.
    if (view.level != LevelIndex::rigid) next.set_state(id, state.displacement, state.velocity);
    simulated->character = id;
  }
  world_ = std::move(next);
  for (const auto& simulated : simulated_) {
    set_level_now(*simulated);
    take_lattice(*simulated);
  }
}

// Across a change of lattice, shows the old one until the new one's time.
void PlayedWorld::show(Simulated& simulated) const {
  const double into = 1 - (tick_time_s(tick_) - shown_s_) * def_.tick_rate_hz;
  const auto share = static_cast<float>(std::clamp(into, 0.0, 1.0));
  // Displacements of two lattices belong to different nodes and cannot be mixed.
  const bool joined = simulated.before.geometry == simulated.after.geometry;
  simulated.lattice = joined || share >= 1 ? &simulated.after : &simulated.before;
  simulated.displacement = simulated.lattice->displacement;
  if (joined && share < 1) {
    for (std::size_t i = 0; i < simulated.displacement.size(); ++i)
      simulated.displacement[i] =
          (1 - share) * simulated.before.displacement[i] + share * simulated.after.displacement[i];
  }
  if (simulated.displacement.empty()) return;
  simulated.grid.resize(simulated.lattice->geometry->lattice.node_count());
  expand_displacements(*simulated.lattice->geometry, simulated.displacement, simulated.grid);
}

PlayedWorld::Shown PlayedWorld::shown(Id id) const {
  const Simulated& simulated = at(id);
  const Lattice& lattice = *simulated.lattice;
  Shown shown;
  shown.pose = simulated.pose(shown_s_, shown_s_).pose;
  shown.level = lattice.level;
  shown.geometry = lattice.geometry;
  shown.displacement = simulated.displacement;
  if (!simulated.displacement.empty()) shown.lattice = {lattice.geometry.get(), simulated.grid};
  if (lattice.geometry && simulated.levels) shown.model = {simulated.levels, &(*simulated.levels)[lattice.level]};
  return shown;
}

LatticeView PlayedWorld::lattice(Id id) const {
  return world_.lattice(at(id).character);
}

PlayedWorld::Simulated& PlayedWorld::at(Id id) {
  const auto found = std::ranges::lower_bound(simulated_, id, {}, [](const auto& simulated) { return simulated->id; });
  HAIRNET_ASSERT(found != simulated_.end() && (*found)->id == id);
  return **found;
}

const PlayedWorld::Simulated& PlayedWorld::at(Id id) const {
  return const_cast<PlayedWorld*>(this)->at(id);
}

}  // namespace hairnet::local
