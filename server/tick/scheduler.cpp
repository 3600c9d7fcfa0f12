#include "server/tick/scheduler.hpp"

#include <algorithm>
#include <utility>

#include "server/tick/measure.hpp"
#include "server/tick/publish.hpp"

namespace hairnet::server {
namespace {

bool same_bits(const Pose& a, const Pose& b) {
  for (std::size_t i = 0; i < kBoneCount; ++i) {
    if (a.bones[i].rotation.coeffs() != b.bones[i].rotation.coeffs() || a.bones[i].position != b.bones[i].position)
      return false;
  }
  return true;
}

bool at_rest(const LatticeView& lattice) {
  return std::all_of(lattice.displacement.begin(), lattice.displacement.end(),
                     [](const Vec3f& d) { return d.isZero(0); });
}

SchedulerDef completed(SchedulerDef def) {
  def.world.tick_s = 1.0 / def.tick_rate_hz;
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
      room_(room_counters),
      simulation_(def_.world, def_.wind) {
  counters_->gauges.tick_budget_seconds.set(def_.world.tick_s);
  if (recorder_) recorder_->put(header_of(def_));
}

void Scheduler::run_tick(const TickClock::Tick& tick, std::int64_t now_ns) {
  counters_->ticks_run.add();
  counters_->ticks_skipped.add(tick.skipped);
  if (tick.late) counters_->ticks_late.add();
  inputs_ = {};
  inputs_.tick = tick.tick;
  inputs_.sample_time_ns = tick.time_ns - def_.pose_delay_ns;

  take_commands(now_ns);
  sample_poses();
  choose_levels();
  change_materials();
  send_level_records(now_ns);
  step();
  publish(room_, simulation_, inputs_, def_.world.parallel_for, *counters_);
  if (tick.tick % def_.tick_rate_hz == 0) measure(room_, simulation_, counters_->gauges);
  record();
}

struct Scheduler::Taker {
  Scheduler& scheduler;
  std::int64_t now_ns;

  Outlet* outlet(SessionId session) const {
    const auto observer = scheduler.room_.observers().find(session);
    return observer == scheduler.room_.observers().end() ? nullptr : observer->second.outlet.get();
  }
  void operator()(OpenSession& c) const { scheduler.room_.open(c.session, std::move(c.outlet)); }
  void operator()(const CloseSession& c) const {
    auto& characters = scheduler.room_.characters();
    const auto first = characters.lower_bound(character_key(c.session, 0));
    std::vector<CharacterKey> keys;
    for (auto it = first; it != characters.end() && session_of(it->first) == c.session; ++it) keys.push_back(it->first);
    for (const CharacterKey key : keys) scheduler.remove(key);
    scheduler.room_.close(c.session);
  }
  void operator()(const AddCharacter& c) const {
    scheduler.room_.add(c.character, c.groom, c.level);
    const LevelIndex level = scheduler.simulation_.levels(c.groom) ? c.level : LevelIndex::rigid;
    if (Outlet* to = outlet(session_of(c.character)))
      to->push(wire::CharacterAdded{number_of(c.character), c.groom, level}, now_ns);
  }
  void operator()(const RemoveCharacter& c) const {
    scheduler.remove(c.character);
    if (Outlet* to = outlet(session_of(c.character))) to->push(wire::CharacterRemoved{number_of(c.character)}, now_ns);
  }
  void operator()(const SetLevel& c) const {
    if (Character* character = scheduler.room_.find(c.character)) character->wanted = c.level;
  }
  void operator()(const SetMaterial& c) const {
    Character* character = scheduler.room_.find(c.character);
    if (!character || character->material == c.scale) return;
    character->material = c.scale;
    character->material_changed = true;
  }
  void operator()(const SetWind& c) const { scheduler.inputs_.wind = c.wind; }
  void operator()(const PutPoses& c) const { scheduler.room_.put(c); }
  void operator()(GroomReady& c) const {
    scheduler.simulation_.put_levels(c.groom, std::move(c.levels));
    if (scheduler.recorder_ && c.bytes) scheduler.unrecorded_[c.groom] = std::move(c.bytes);
  }
  void operator()(const ForgetGroom& c) const {
    scheduler.simulation_.forget_levels(c.groom);
    scheduler.unrecorded_.erase(c.groom);
  }
};

void Scheduler::take_commands(std::int64_t now_ns) {
  counters_->gauges.commands_waiting.set(static_cast<double>(commands_->weight()));
  commands_->take_all(taken_);
  for (Command& command : taken_) std::visit(Taker{*this, now_ns}, command);
  taken_.clear();
}

void Scheduler::remove(CharacterKey key) {
  const Character* character = room_.find(key);
  if (!character) return;
  if (character->placed) inputs_.removed.push_back(key);
  room_.remove(key);
}

void Scheduler::sample_poses() {
  const std::int64_t tick_ns = inputs_.sample_time_ns + def_.pose_delay_ns;
  Histogram::Tally ages(counters_->histograms.pose_age_seconds);
  for (auto& [key, character] : room_.characters()) {
    character.discontinuous = false;
    const PoseInbox::Sample sample = room_.sample(character, inputs_.sample_time_ns);
    if (sample.kind == PoseInbox::Kind::none) continue;
    // Of a clock that is ahead of ours a pose may come from a moment later than the tick.
    ages.observe(static_cast<double>(std::max<std::int64_t>(0, tick_ns - *character.inbox.newest_ns())) * 1e-9);
    // What the step uses is what the frame and the recording say, bit for bit.
    const Pose pose = rounded_to_wire(sample.pose);
    // An extrapolation may leave the bounds that poses are held to, and clients hold frames to.
    if (wire::validate_pose(pose) != wire::PoseRefusal::none) continue;
    if (character.placed)
      move(key, character, sample, pose);
    else
      place(key, character, pose);
  }
}

void Scheduler::place(CharacterKey key, Character& character, const Pose& pose) {
  const bool ready = simulation_.levels(character.groom) != nullptr;
  character.placed = true;
  character.discontinuous = true;
  character.level = ready ? character.wanted : LevelIndex::rigid;
  character.pose = pose;
  inputs_.added.push_back({key, character.groom, ready, character.level, pose});
}

void Scheduler::move(CharacterKey key, Character& character, const PoseInbox::Sample& sample, const Pose& pose) {
  if (!sample.teleported && same_bits(pose, character.pose)) return;  // the World holds it
  // The same test as the World's, so that the frame says what the step did.
  character.discontinuous = sample.teleported || is_teleport(character.pose, pose, def_.world.tick_s);
  character.pose = pose;
  inputs_.poses.push_back({key, character.discontinuous, pose});
}

void Scheduler::choose_levels() {
  for (auto& [key, character] : room_.characters()) {
    if (!character.placed || character.level == character.wanted) continue;
    if (character.wanted != LevelIndex::rigid && !simulation_.levels(character.groom)) continue;
    character.level = character.wanted;
    inputs_.levels.push_back({key, character.level});
    counters_->levels_entered.add();
  }
}

void Scheduler::change_materials() {
  for (auto& [key, character] : room_.characters()) {
    if (!character.placed || !std::exchange(character.material_changed, false)) continue;
    inputs_.materials.push_back({key, character.material});
  }
}

void Scheduler::send_level_records(std::int64_t now_ns) {
  for (const wire::RecordedAdd& added : inputs_.added) {
    if (added.levels_ready) record_groom(added.groom);
    send_level_record(added.character, added.groom, added.level, now_ns);
  }
  for (const wire::RecordedLevel& change : inputs_.levels) {
    const wire::GroomHash& groom = room_.find(change.character)->groom;
    record_groom(groom);
    send_level_record(change.character, groom, change.level, now_ns);
  }
}

void Scheduler::send_level_record(CharacterKey key, const wire::GroomHash& groom, LevelIndex level,
                                  std::int64_t now_ns) {
  if (level == LevelIndex::rigid) return;
  const auto observer = room_.observers().find(session_of(key));
  if (observer == room_.observers().end() || !observer->second.records_sent.emplace(groom, level).second) return;
  counters_->level_records_sent.add();
  observer->second.outlet->push(wire::LevelRecord{groom, level, (*simulation_.levels(groom))[level].geometry}, now_ns);
}

void Scheduler::step() {
  const StepReport report = simulation_.step(inputs_);
  counters_->characters_stepped.add(report.stepped);
  counters_->teleports.add(report.teleports);
  counters_->lattices_reset.add(report.lattices_reset);
  counters_->characters_asleep.add(report.asleep);
  if (report.lattices_reset > 0) mark_reset_lattices();
  mark_level_switches();
}

void Scheduler::mark_level_switches() {
  for (auto& [key, character] : room_.characters()) {
    if (!character.placed) continue;
    const LevelIndex level = simulation_.lattice(key).level;
    if (std::exchange(character.shown, level) != level) character.discontinuous = true;
  }
}

void Scheduler::mark_reset_lattices() {
  // A lattice at exact rest has just been reset, or lies still anyway: a discontinuity of nothing.
  for (auto& [key, character] : room_.characters()) {
    if (character.placed && character.level != LevelIndex::rigid && at_rest(simulation_.lattice(key)))
      character.discontinuous = true;
  }
}

void Scheduler::record_groom(const wire::GroomHash& groom) {
  const auto bytes = unrecorded_.find(groom);
  if (bytes == unrecorded_.end()) return;
  recorder_->put_groom(std::move(bytes->second));
  unrecorded_.erase(bytes);
}

void Scheduler::record() {
  if (!recorder_ || recorder_->failed()) return;
  inputs_.state_hash = simulation_.hash();
  recorder_->put(std::move(inputs_));
}

}  // namespace hairnet::server
