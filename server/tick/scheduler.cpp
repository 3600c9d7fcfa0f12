#include "server/tick/scheduler.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "core/assert.hpp"
#include "core/levels/level_map.hpp"
#include "server/tick/character_gauges.hpp"

namespace hairnet::server {
namespace {

// An observer's members are chosen by distance once in this many ticks, 0.27 s at the default 30 Hz.
constexpr std::uint64_t kInterestTicks = 8;
// The wind of one room changes at most this often, because each change wakes the hair of the whole room.
constexpr std::uint32_t kWindChangesPer_s = 4;
// A hair state waits this long for levels that are still being built; then its character enters rigid.
constexpr std::uint64_t kStateWait_s = 2;
// The time constant of the mean speeds of heads, which the budget uses.
constexpr double kMotionSmoothing_s = 1;
// A client that reports no sizes counts as one that sees each head at a quarter of its screen's height.
constexpr float kScreenHeightUnreported = 0.25f;

std::size_t bytes_of(const wire::HairState& state) {
  return (state.displacements.size() + state.velocities.size()) * sizeof(std::int16_t);
}

void copy_vectors(const std::vector<std::int16_t>& integers, float unit, std::vector<Vec3f>& to) {
  HAIRNET_ASSERT(integers.size() % 3 == 0);
  for (std::size_t i = 0; i + 2 < integers.size(); i += 3)
    to.push_back(unit * Vec3f(integers[i], integers[i + 1], integers[i + 2]));
}

bool is_same(const Wind& a, const Wind& b) {
  const auto values = [](const Wind& w) {
    return std::tie(w.mean_m_per_s, w.gust_ratio, w.gust_period_s, w.turbulence_rms_m_per_s, w.turbulence_scale_m,
                    w.seed, w.carried);
  };
  return values(a) == values(b);
}

bool is_same(const Pose& a, const Pose& b) {
  return std::ranges::equal(a.bones, b.bones, [](const RigidTransform& x, const RigidTransform& y) {
    return x.position == y.position && x.rotation.coeffs() == y.rotation.coeffs();
  });
}

// Turns a hair state of the finest level into one of level `to`. A state that does not have the nodes of the finest
// level is left as it is; the World then refuses it.
void carry_over(const LevelSet& levels, LevelIndex to, wire::RecordedState& state) {
  const LevelMap* const map = levels.map(LevelIndex::high, to);
  if (to == LevelIndex::high || !map) return;
  if (state.displacements.size() != levels[LevelIndex::high].rest.size()) return;
  for (std::vector<Vec3f>* vectors : {&state.displacements, &state.velocities}) {
    // The map takes displacements of one lattice to another; it is linear, so it serves velocities, too.
    std::vector<Vec3f> carried(levels[to].rest.size());
    map->apply(*vectors, carried);
    *vectors = std::move(carried);
  }
  // The map may move a node a little farther than frames can express (displacement_max_m). Scaling all nodes alike
  // keeps the shape of the hair.
  float farthest_m = 0;
  for (const Vec3f& d : state.displacements) farthest_m = std::max(farthest_m, d.norm());
  const float bound_m = levels[to].displacement_max_m;
  if (farthest_m > bound_m) {
    for (Vec3f& d : state.displacements) d *= bound_m / farthest_m;
  }
}

// One tick rate and one clock serve all parts: they could not be set apart from each other.
SchedulerDef completed(SchedulerDef def) {
  HAIRNET_ASSERT(def.tick_rate_hz > 0);
  def.world.tick_s = def.levels.tick_s = 1.0 / def.tick_rate_hz;
  def.publish.tick_s = def.world.tick_s;
  def.levels.now_ns = def.publish.now_ns = def.world.now_ns;
  if (def.world.substep_count == 0) def.world.substep_count = substep_count_for(def.world.tick_s);
  if (!def.world.parallel_for) {
    def.world.parallel_for = [](std::size_t count, const std::function<void(std::size_t)>& body) {
      for (std::size_t i = 0; i < count; ++i) body(i);
    };
  }
  return def;
}

wire::RecordingHeader header_of(const SchedulerDef& def) {
  wire::RecordingHeader header;
  header.tick_rate_hz = def.tick_rate_hz;
  header.substep_count = def.world.substep_count;
  header.iterations = def.world.iterations;
  for (int a = 0; a < 3; ++a) {
    header.gravity[static_cast<std::size_t>(a)] = def.world.environment.gravity[a];
  }
  header.wind = def.wind;
  return header;
}

}  // namespace

Scheduler::Scheduler(const SchedulerDef& def, CommandQueue& commands, RoomCounters& room_counters,
                     TickCounters& counters, Recorder* recorder)
    : def_(completed(def)),
      commands_(&commands),
      counters_(&counters),
      recorder_(recorder),
      rooms_(room_counters, def.wind, def.room_grace_ns, def.room_count_max),
      simulation_(def_.world, def_.wind),
      touch_(rooms_, counters, def.tick_rate_hz),
      level_chooser_(def_.levels, counters),
      publisher_(def_.publish, counters) {
  counters_->gauges.tick_period_seconds.set(def_.world.tick_s);
  if (recorder_) recorder_->put(header_of(def_));
}

// The World has only characters that were placed, and the waiting hair states are counted in full.
void Scheduler::check_invariants() const {
  HAIRNET_ASSERT(state_bytes_ <= def_.state_bytes_max);
#ifdef HAIRNET_VALIDATE_ON
  std::size_t state_bytes = 0;
  for (const auto& [key, character] : rooms_.characters()) {
    HAIRNET_ASSERT(character.key == key);
    HAIRNET_ASSERT(character.in_world || !simulation_.contains(key));
    if (character.state) state_bytes += bytes_of(*character.state);
  }
  HAIRNET_ASSERT(state_bytes == state_bytes_);
#endif
}

void Scheduler::run_tick(const TickClock::Tick& tick, std::int64_t now_ns) {
  const std::int64_t begun_ns = clock_ns();
  counters_->ticks_run.add();
  counters_->ticks_skipped.add(tick.skipped);
  if (tick.late) counters_->ticks_late.add();
  // The array of poses keeps its memory from tick to tick; with all its poses it is the largest part of the inputs.
  std::vector<wire::RecordedPose> poses = std::move(inputs_.poses);
  inputs_ = {};
  // sample_poses() writes over these poses.
  inputs_.poses = std::move(poses);
  inputs_.tick = tick.tick;
  inputs_.sample_time_ns = tick.time_ns - def_.pose_delay_ns;

  // The order matters. Sessions that wait for announcements are served before new ones join their line. Commands come
  // before poses, so a new character is placed in the tick of its first pose. Interest needs poses, levels need
  // interest, and hair states need levels. Frames follow the step. Measuring comes last, when all times of the tick are
  // known.
  announce_members(now_ns);
  touch_.begin_tick(inputs_);
  take_commands(now_ns);
  tell_appearances(now_ns);
  touch_.tell_rules(inputs_.tick, now_ns, character_messages_left_);
  sample_poses();
  update_interest();
  touch_.put_inputs(now_ns, inputs_);
  level_chooser_.choose(rooms_, simulation_, inputs_);
  apply_hair_states();
  change_materials();
  change_winds(now_ns);
  record_grooms();
  counters_->schedule_ns_total.add(static_cast<std::uint64_t>(clock_ns() - begun_ns));
  const StepReport report = step(now_ns);
  touch_.show_hands(inputs_, def_.world.parallel_for, now_ns);
  publisher_.publish(rooms_, simulation_, inputs_, def_.world.parallel_for, now_ns);
  // The gauges visit all characters, so they are set once a second.
  if (tick.tick % def_.tick_rate_hz == 0) update_character_gauges(rooms_, simulation_, counters_->gauges);
  record();
  rooms_.poll(now_ns);
  check_invariants();
  level_chooser_.observe(rooms_, report.costs, static_cast<double>(clock_ns() - begun_ns) * 1e-9);
}

void Scheduler::sample_poses() {
  const std::span<Character* const> everyone = rooms_.everyone();
  run_chunks(def_.world.parallel_for, everyone.size(), [&](std::size_t begin, std::size_t end) {
    // Each chunk counts by itself: an atomic for every character would make workers wait for each other.
    Histogram::Tally ages(counters_->histograms.pose_age_seconds);
    for (std::size_t i = begin; i < end; ++i) sample_pose(*everyone[i], ages);
  });
  // What follows changes shared lists, so one thread does it, in the order of characters: the recording must not depend
  // on the number of workers.
  moved_.clear();
  for (Character* character : everyone) {
    if (!character->pose_changed) continue;
    // A character that waits for its levels has a pose and is not placed yet.
    if (character->in_world)
      moved_.push_back(character);
    else if (!awaits_levels(*character))
      place(*character);
  }
  // Each worker writes to its own places, so copying poses needs no lock.
  inputs_.poses.resize(moved_.size());
  run_chunks(def_.world.parallel_for, moved_.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      inputs_.poses[i] = {moved_[i]->key, moved_[i]->pose_teleport, moved_[i]->pose};
  });
}

void Scheduler::sample_pose(Character& character, Histogram::Tally& ages) {
  character.pose_changed = character.discontinuous = character.seen = false;
  character.screen_height = 0;
  character.observer_count = 0;
  const PoseInbox::Sample sample = rooms_.sample(character, inputs_.sample_time_ns);
  if (sample.kind == PoseInbox::Kind::none) return;
  // A client's clock may be ahead of ours, so a pose may be newer than the tick: its age is then 0. An age above
  // kAgeMax_ns means that the client is silent, not that its poses are late, so it is not counted.
  const std::int64_t tick_ns = inputs_.sample_time_ns + def_.pose_delay_ns;
  const std::int64_t age_ns = std::max<std::int64_t>(0, tick_ns - *character.inbox.newest_ns());
  if (age_ns <= PoseInbox::kAgeMax_ns) ages.observe(static_cast<double>(age_ns) * 1e-9);
  // An extrapolated pose may be out of range. Clients reject frames with such poses.
  if (wire::validate_pose(sample.pose) != wire::PoseRefusal::none) return;
  // A recording has exactly the same pose, so a replay steps from the same bits.
  const Pose pose = rounded_to_wire(sample.pose);
  if (character.in_world && !sample.teleport && is_same(pose, character.pose))
    // The World has this pose already.
    return note_motion(character, 0, 0);
  const Pose pose_before = std::exchange(character.pose, pose);
  character.pose_changed = true;
  character.pose_teleport = sample.teleport;
  if (!character.in_world) return;
  const RigidTransform &from = pose_before.head(), &to = character.pose.head();
  note_motion(character, (to.position - from.position).norm(), to.rotation.angularDistance(from.rotation));
}

// A character with a hair state waits up to kStateWait_s for its levels, so that its owner does not see rigid hair for
// a moment after a server restart.
bool Scheduler::awaits_levels(Character& character) const {
  return character.state && !simulation_.has_levels(character.groom) &&
         character.state_ticks++ < kStateWait_s * static_cast<std::uint64_t>(def_.tick_rate_hz);
}

// Adds the character to the World on the rigid level; when its levels are ready, one is chosen in the same tick.
void Scheduler::place(Character& character) {
  HAIRNET_ASSERT(!character.in_world);
  const bool ready = simulation_.has_levels(character.groom);
  character.in_world = true;
  character.discontinuous = true;
  // The character enters rigid: a lattice would need a level, which LevelChooser chooses later in this tick.
  inputs_.added.push_back({character.key, character.groom, character.room, ready, LevelIndex::rigid, character.pose,
                           session_of(character.key)});
}

void Scheduler::note_motion(Character& character, double moved_m, double turned_rad) const {
  // A moving mean with this time constant; it holds at every tick rate.
  const double share = std::min(1.0, def_.world.tick_s / kMotionSmoothing_s);
  const auto smooth = [&](float& mean, double moved) {
    mean += static_cast<float>(share * (moved / def_.world.tick_s - static_cast<double>(mean)));
  };
  smooth(character.head_speed_m_per_s, moved_m);
  smooth(character.head_angular_speed_rad_per_s, turned_rad);
}

View& Scheduler::view_of(Observer& observer, const Room& room, std::size_t slot) {
  HAIRNET_ASSERT(slot < observer.views.size());
  HAIRNET_ASSERT(slot < room.slots.size());
  View& view = observer.views[slot];
  // The slot has another character now: what this session was sent of the last one says nothing of it.
  if (view.generation != room.slots[slot].generation) {
    view = {};
    view.generation = room.slots[slot].generation;
  }
  return view;
}

void Scheduler::update_interest() {
  for (Room& room : rooms_.rooms()) {
    if (!room.in_use) continue;
    for (Observer* observer : room.observers) update_interest(room, *observer);
  }
}

void Scheduler::update_interest(const Room& room, Observer& observer) {
  if (!observer.sink) return;
  observer.views.resize(room.slots.size());
  const bool by_place = observer.chooses_by_place();
  // A choice by place goes stale as heads move; a choice by name changes only when the client or the members do.
  const bool look = by_place ? inputs_.tick >= observer.place_chosen_next : observer.observe_changed;
  if (look) {
    heads_.clear();
    for (std::size_t s = 0; s < room.slots.size(); ++s) {
      const Character* c = room.slots[s].character;
      // Member numbers are slots plus one, since 0 means no member in the protocol.
      heads_.push_back({static_cast<std::uint32_t>(s + 1), c ? c->pose.head().position : Vec3::Zero(),
                        c && session_of(c->key) == observer.session, c && c->in_world});
    }
    choose_members(observer.observe, heads_, wanted_);
    HAIRNET_ASSERT(wanted_.size() == room.slots.size());
    observer.observe_changed = false;
    if (by_place) {
      counters_->place_choices.add();
      // The session's number shifts its turn, so that not all sessions choose at the same tick.
      observer.place_chosen_next = inputs_.tick + kInterestTicks - (inputs_.tick + observer.session) % kInterestTicks;
    }
  }
  for (std::size_t s = 0; s < room.slots.size(); ++s) {
    Character* c = room.slots[s].character;
    if (!c) continue;
    const bool is_new = observer.views[s].generation != room.slots[s].generation;
    View& view = view_of(observer, room, s);
    if (look)
      view.wanted = wanted_[s];
    else if (is_new && by_place)
      // Characters of other sessions wait for the next choice by distance.
      view.wanted = session_of(c->key) == observer.session;
    if (!view.wanted || !view.in_view) continue;
    // The largest size on any observer's screen decides: detail that one observer needs is computed once for all.
    c->seen = true;
    ++c->observer_count;
    c->screen_height =
        std::max(c->screen_height, view.screen_height < 0 ? kScreenHeightUnreported : view.screen_height);
  }
}

void Scheduler::apply_hair_states() {
  for (const wire::RecordedLevel& change : inputs_.levels) {
    Character* const changed = rooms_.find(change.character);
    HAIRNET_ASSERT(changed);
    Character& character = *changed;
    // A character still without lattice keeps its state for the level that comes later.
    if (change.level == LevelIndex::rigid || !character.state) continue;
    // The learnt level has no lattice that could take displacements.
    if (!has_lattice(change.level)) {
      forget_hair_state(character);
      continue;
    }
    const wire::HairState& state = *character.state;
    wire::RecordedState& recorded = inputs_.states.emplace_back();
    recorded.character = character.key;
    copy_vectors(state.displacements, state.step_m, recorded.displacements);
    copy_vectors(state.velocities, wire::kVelocityStepsPer_s * state.step_m, recorded.velocities);
    // A state may come without velocities; its hair then starts at rest from where it is.
    recorded.velocities.resize(recorded.displacements.size(), Vec3f::Zero());
    carry_over(*simulation_.levels(character.groom), change.level, recorded);
    forget_hair_state(character);
  }
}

void Scheduler::store_hair_state(Character& character, wire::HairState state, std::int64_t now_ns) {
  HAIRNET_ASSERT(!character.state);
  HAIRNET_ASSERT(wire::validate(state).empty());
  const std::size_t bytes = bytes_of(state);
  // Hair that stays rigid would never use it.
  if (character.requested_level == LevelIndex::rigid) return;
  if (state_bytes_ + bytes > def_.state_bytes_max) {
    counters_->hair_states_dropped_full.add();
    return refuse_hair_state(character.key, "too many hair states wait for their levels; this hair starts at rest",
                             now_ns);
  }
  state_bytes_ += bytes;
  character.state = std::move(state);
}

void Scheduler::forget_hair_state(Character& character) {
  if (!character.state) return;
  HAIRNET_ASSERT(state_bytes_ >= bytes_of(*character.state));
  state_bytes_ -= bytes_of(*character.state);
  character.state.reset();
}

void Scheduler::refuse_hair_state(CharacterKey key, std::string detail, std::int64_t now_ns) {
  const Observer* owner = rooms_.observer(session_of(key));
  if (!owner || !owner->sink) return;
  owner->sink->push(wire::Error{wire::ErrorReason::state_invalid, number_of(key), {}, std::move(detail)}, now_ns);
}

void Scheduler::change_materials() {
  std::erase_if(materials_changed_, [this](CharacterKey key) {
    const Character* character = rooms_.find(key);
    // A change waits for its character: the World does not know it before its first pose.
    if (character && !character->in_world) return false;
    if (character) inputs_.materials.push_back({key, character->material});
    return true;
  });
}

void Scheduler::change_winds(std::int64_t now_ns) {
  for (Room& room : rooms_.rooms()) {
    if (!room.in_use || inputs_.tick < room.wind_changes_next) continue;
    if (room.wind_in_world && is_same(*room.wind_in_world, room.wind)) continue;
    // The first wind of a room waits for nothing. Later ones come a few times a second at most: clients may send as
    // many as they like, and each is announced to the whole room.
    if (room.wind_in_world) room.wind_changes_next = inputs_.tick + def_.tick_rate_hz / kWindChangesPer_s;
    room.wind_in_world = room.wind;
    counters_->winds_changed.add();
    inputs_.winds.push_back({room.index, room.wind});
    if (is_same(room.wind_announced.wind, room.wind)) continue;
    room.wind_announced = {room.wind, room.wind_session};
    for (const Observer* observer : room.observers) {
      if (observer->sink) observer->sink->push(room.wind_announced, now_ns);
    }
  }
}

void Scheduler::record_grooms() {
  if (!recorder_) return;
  for (const wire::RecordedAdd& added : inputs_.added) {
    if (added.levels_ready) record_groom(added.groom);
  }
  for (const wire::RecordedLevel& change : inputs_.levels) record_groom(rooms_.find(change.character)->groom);
}

StepReport Scheduler::step(std::int64_t now_ns) {
  // A replay calls the same function with the recorded inputs, and so reaches the same state.
  const StepReport report = simulation_.step(inputs_);
  counters_->characters_stepped.add(report.stepped);
  counters_->teleports.add(report.teleports);
  counters_->lattices_reset.add(report.lattices_reset);
  counters_->characters_asleep.add(report.asleep);
  counters_->bodies_refused.add(report.bodies_refused);
  counters_->bodies_left_out.add(report.bodies_left_out);
  counters_->gauges.characters_touched.set(report.touched);
  touch_.tell_holds(simulation_, inputs_, now_ns);
  for (const CharacterKey key : simulation_.hair_states_refused()) {
    counters_->hair_states_dropped_unfit.add();
    refuse_hair_state(key, "the hair state does not fit the level", now_ns);
  }
  return report;
}

void Scheduler::record_groom(const wire::GroomHash& groom) {
  HAIRNET_ASSERT(recorder_);
  // A groom that nobody uses is never written; one that is used is written once.
  if (auto file = unrecorded_.extract(groom)) recorder_->put_groom(std::move(file.mapped()));
  if (auto learnt = unrecorded_learnt_.extract(groom)) recorder_->put({groom, std::move(learnt.mapped())});
}

void Scheduler::record() {
  if (!recorder_ || recorder_->failed()) return;
  // The hash covers the state after this tick's step, and a replay compares it at every tick.
  inputs_.state_hash = simulation_.hash();
  recorder_->put(std::move(inputs_));
}

}  // namespace hairnet::server
