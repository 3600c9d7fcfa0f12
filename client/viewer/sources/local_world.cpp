#include "client/viewer/sources/local_world.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hairnet::viewer {
namespace {

constexpr double kCatchUpMost_s = 0.1;  // a machine that is too slow shows slow motion
constexpr double kTimeRounding_s = 1e-9;

bool has_level(const LevelSet& levels, LevelIndex level) {
  return level == LevelIndex::rigid || !levels[level].rest.empty();
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
  auto actor = std::make_unique<Actor>(std::move(character), def_.duration_s, def_.loop);
  actor->id = next_id_++;
  if (actor->def.material) actor->material = scale_between(actor->def.groom->materials.base, *actor->def.material);
  CharacterDef def;
  def.pose = rounded_to_wire(pose_of(*actor, tick_time_s(tick_)));
  actor->character = world_.add(def);
  world_.set_material(actor->character, actor->material);
  actors_.push_back(std::move(actor));
  show();
  return actors_.back()->id;
}

void LocalWorld::remove_all() {
  actors_.clear();
  world_ = World(world_def(def_));
  start_s_ = shown_s_ = -Performance::kLeadIn_s;
  start_tick_ = tick_ = 0;
  show();
}

void LocalWorld::give_levels(const Groom& groom, const std::shared_ptr<const LevelSet>& levels) {
  for (const auto& actor : actors_) {
    if (actor->def.groom.get() != &groom || actor->levels) continue;
    actor->levels = levels;
    world_.set_levels(actor->character, levels);
    set_level_now(*actor);
  }
}

void LocalWorld::set_level_now(Actor& actor) {
  if (actor.levels && has_level(*actor.levels, actor.level_wanted))
    world_.set_level(actor.character, actor.level_wanted);
}

std::vector<std::shared_ptr<const Groom>> LocalWorld::grooms_without_levels() const {
  std::vector<std::shared_ptr<const Groom>> grooms;
  for (const auto& actor : actors_) {
    if (!actor->levels && std::find(grooms.begin(), grooms.end(), actor->def.groom) == grooms.end())
      grooms.push_back(actor->def.groom);
  }
  return grooms;
}

double LocalWorld::tick_time_s(std::uint64_t tick) const {
  return start_s_ + static_cast<double>(tick - start_tick_) / def_.tick_rate_hz;
}

Pose LocalWorld::pose_of(const Actor& actor, double time_s) const {
  Place place = actor.def.place;
  if (actor.aside) place.x_m += kAside_m;
  return actor.grab.apply(placed(place, actor.performance.at(time_s)), actor.def.groom->body);
}

void LocalWorld::tick() {
  const double from_s = tick_time_s(tick_), to_s = tick_time_s(++tick_);
  for (const auto& actor : actors_) {
    const bool teleport = std::exchange(actor->jumps, false) || actor->performance.jumps(from_s, to_s);
    world_.set_pose(actor->character, rounded_to_wire(pose_of(*actor, to_s)), teleport);
  }
  const std::int64_t began_ns = def_.clock_ns != nullptr ? def_.clock_ns() : 0;
  LocalTick done{tick_, to_s, world_.step(), 0};
  if (def_.clock_ns != nullptr) done.step_ms = 1e-6 * static_cast<double>(def_.clock_ns() - began_ns);
  ticks_.push_back(done);
  for (const auto& actor : actors_) take_lattice(*actor);
  if (on_tick_) on_tick_();
}

void LocalWorld::take_lattice(Actor& actor) {
  std::swap(actor.before, actor.after);
  const LatticeView view = world_.lattice(actor.character);
  Lattice& after = actor.after;
  after.level = view.level;
  after.displacement.assign(view.displacement.begin(), view.displacement.end());
  if (view.model == nullptr) {
    after.geometry = nullptr;
  } else if (after.geometry.get() != &view.model->geometry) {
    after.geometry = {actor.levels, &view.model->geometry};
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
      std::clamp(1e-9 * static_cast<double>(now_ns - last_ns_.value_or(now_ns)), 0.0, kCatchUpMost_s);
  last_ns_ = now_ns;
  for (const auto& actor : actors_) actor->grab.advance(elapsed_s);
  advance_to(paused_ ? shown_s_ : shown_s_ + speed_ * elapsed_s);
  return {};
}

void LocalWorld::set_tick_rate(double hz) {
  if (hz == def_.tick_rate_hz) return;
  start_s_ = tick_time_s(tick_);
  def_.tick_rate_hz = hz;
  start_tick_ = tick_;
  World next(world_def(def_));
  for (const auto& actor : actors_) {
    CharacterDef def;
    const LatticeView view = world_.lattice(actor->character);
    def.levels = actor->levels;
    def.level = view.level;
    def.pose = *view.pose;
    const CharacterId id = next.add(def);
    next.set_material(id, actor->material);
    const LatticeState& state = world_.state(actor->character);
    if (view.level != LevelIndex::rigid) next.set_state(id, state.displacement, state.velocity);
    actor->character = id;
    set_level_now(*actor);
  }
  world_ = std::move(next);
  for (const auto& actor : actors_) take_lattice(*actor);
}

std::optional<LatticeView> LocalWorld::lattice(std::uint64_t id) const {
  for (const auto& actor : actors_) {
    if (actor->id == id) return world_.lattice(actor->character);
  }
  return {};
}

LocalWorld::Actor* LocalWorld::find(std::uint64_t id) {
  const auto found = std::find_if(actors_.begin(), actors_.end(), [id](const auto& actor) { return actor->id == id; });
  return found == actors_.end() ? nullptr : found->get();
}

HeadGrab* LocalWorld::grab(std::uint64_t id) {
  Actor* actor = find(id);
  return actor != nullptr ? &actor->grab : nullptr;
}

void LocalWorld::set_material(std::uint64_t id, const MaterialScale& scale) {
  Actor* actor = find(id);
  if (actor == nullptr || !validate(scale).empty()) return;
  actor->material = scale;
  world_.set_material(actor->character, scale);
}

void LocalWorld::set_level(std::uint64_t id, LevelIndex level) {
  Actor* actor = find(id);
  if (actor == nullptr) return;
  actor->level_wanted = level;
  set_level_now(*actor);
}

void LocalWorld::teleport(std::uint64_t id) {
  Actor* actor = find(id);
  if (actor == nullptr) return;
  actor->aside = !actor->aside;
  actor->jumps = true;
}

void LocalWorld::set_wind(const Wind& wind) {
  if (!validate(wind).empty()) return;
  def_.wind = wind;
  world_.set_environment({Environment{}.gravity, WindField(wind)});
}

void LocalWorld::show() {
  subjects_.resize(actors_.size());
  for (std::size_t i = 0; i < actors_.size(); ++i) show(*actors_[i], subjects_[i]);
}

void LocalWorld::show(Actor& actor, Subject& subject) {
  // Over a change of lattice the one before is shown until the new one's time.
  const double into = 1 - (tick_time_s(tick_) - shown_s_) * def_.tick_rate_hz;
  const auto share = static_cast<float>(std::clamp(into, 0.0, 1.0));
  const bool joined = actor.before.geometry == actor.after.geometry;
  const Lattice& lattice = joined || share >= 1 ? actor.after : actor.before;
  actor.shown = lattice.displacement;
  if (joined && share < 1) {
    for (std::size_t i = 0; i < actor.shown.size(); ++i)
      actor.shown[i] = (1 - share) * actor.before.displacement[i] + share * actor.after.displacement[i];
  }
  actor.blend.apply({true, {}, lattice.level, actor.shown, std::llround(1e9 * shown_s_), lattice.geometry});

  subject = {};
  subject.id = actor.id;
  subject.name = actor.def.name;
  subject.groom = actor.def.groom;
  subject.hair_colour = actor.def.hair_colour;
  subject.pose = pose_of(actor, shown_s_);
  subject.layers = actor.blend.layers();
  subject.level = lattice.level;
  subject.geometry = lattice.geometry;
  subject.displacement = actor.shown;
  if (lattice.geometry && actor.levels) subject.model = {actor.levels, &(*actor.levels)[lattice.level]};
  subject.material = actor.material;
  subject.level_wanted = actor.level_wanted;
  subject.own = true;
}

}  // namespace hairnet::viewer
