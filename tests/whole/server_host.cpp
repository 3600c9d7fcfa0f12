#include "tests/whole/server_host.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <utility>

#include "core/modes/make_modes.hpp"
#include "schema/codec/pose_code.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/quick_training.hpp"

namespace hairnet::whole {
namespace {

// The server's connections are polled in this period, like by its I/O loop.
constexpr std::int64_t kIoPeriod_ns = 20 * kMs;
// A drained server sends its sessions to other servers for so long (server/app/program.cpp).
constexpr std::int64_t kSendOnMax_ns = 2 * kSecond_ns;
// The number means nothing here, because nobody listens.
constexpr std::uint16_t kPort = 7420;
// The simulated time begins in January 2027. Tokens expire by this clock.
constexpr std::int64_t kUnixStart_s = 1'800'000'000;
// Frames of a tick are sent at most so long after its end, which is before the next tick even if that one is late.
constexpr double kFlush_ns_max = 4e5;

// The simulated time of a build of levels has a fixed part, and a part for each point of the groom.
constexpr std::int64_t kBuild_ns = 20 * kMs, kBuildOfPoint_ns = 3 * kMs;
// An unfair share of the tick may last so long: the server first measures, waits between two changes of a level, and
// raises no level while its budget falls.
constexpr int kUnfair_s_max = 4;

// Stands for the clock that measures work. It advances at each reading and by each build, and so is the same in every
// run.
thread_local std::int64_t measured_ns = 0, reading_lasts_ns = 0;
std::int64_t measure_ns() {
  return measured_ns += reading_lasts_ns;
}

// Learning takes a minute. A network that has learnt nothing is as good where clients and the server evaluate the same.
Result<std::shared_ptr<const LearntHair>> learn_nothing(const Groom&, const std::shared_ptr<const LevelSet>&,
                                                        const BuildCallbacks&) {
  static const auto hair = std::make_shared<const LearntHair>(support::random_learnt_hair(3));
  return hair;
}

// Builds each groom once in all trials of the process, because building takes most of the time. The result is the same
// bits every time.
server::LevelBuild build_once(const server::LevelBuildDef& def, const wire::GroomHash& hash,
                              std::span<const std::uint8_t> file, const Groom& groom, const server::GoesOn& goes_on) {
  static std::mutex mutex;
  static std::map<wire::GroomHash, server::LevelBuild> built;
  const std::lock_guard lock(mutex);
  if (const auto found = built.find(hash); found != built.end() && goes_on() == server::BuildError::none)
    return found->second;
  server::LevelBuild build = server::build_levels_in_process(def, hash, file, groom, goes_on);
  if (build.levels) built.emplace(hash, build);
  return build;
}

Pose as_frames_have_it(const Pose& pose) {
  std::array<std::uint8_t, codec::kPoseBytesMax + codec::kWriterSlackBytes> bytes;
  codec::BitWriter writer(bytes.data());
  return codec::encode_pose(pose, writer);
}

}  // namespace

ServerHost::ServerHost(Timeline& timeline, Journal& journal, const server::Config& config, std::uint64_t seed)
    : timeline_(&timeline), journal_(&journal), config_(config), random_(seed, 2) {}

void ServerHost::join_fleet(EtcdLine& line, double clock_rate) {
  line_ = &line;
  clock_rate_ = clock_rate;
  name_ = config_.fleet.address;
}

void ServerHost::start() {
  Life& life = lives_.emplace_back();
  life.metrics = std::make_unique<server::Metrics>();
  // A clock of a machine counts from its start, so each life has a time of its own, up to 11 days.
  life.clock_offset_ns = static_cast<std::int64_t>(random_.between(0, 1e15));
  life.admission = std::make_shared<server::Admission>(config_.transport.admission);
  rates_ = {};
  unfair_for_.clear();
  const auto build_slowly = [this](const server::LevelBuildDef& def, const wire::GroomHash& hash,
                                   std::span<const std::uint8_t> file, const Groom& groom,
                                   const server::GoesOn& goes_on) {
    building_ns_ =
        // A build that would exceed its limit ends just after it.
        std::min(kBuild_ns + kBuildOfPoint_ns * static_cast<std::int64_t>(groom.points.size()), def.ns_max + kMs);
    measured_ns += building_ns_;
    server::LevelBuildDef quick = def;
    quick.training = support::kQuickTraining;
    return build_once(quick, hash, file, groom, goes_on);
  };
  auto created =
      server::Server::create(config_, *life.metrics, clock_ns(), measure_ns, build_slowly, {}, learn_nothing);
  if (!created) return fault("does not start: " + created.error());
  server_ = std::move(*created);
  server_->set_unix_clock([this] { return kUnixStart_s + timeline_->now_ns() / kSecond_ns; });
  connections_.clear();
  if (line_) start_in_fleet();
  const int number = this->life();
  run_io(number);
  run_tick(number);
  run_builder(number);
}

void ServerHost::start_in_fleet() {
  drained_since_ns_ = -1;
  line_end_ = std::make_unique<EtcdLineEnd>(
      *line_, [this] { return clock_ns(); }, random_.next());
  fleet_ = server::Fleet::create(config_, kPort, random_.next() | 1, *line_end_, *lives_.back().metrics);
  line_end_->set_sink(fleet_->sink());
  line_end_->on_delivered = [this] { note_claims(); };
  claims_.clear();
  server_->join_fleet(fleet_->directory());
  is_news_ = false;
  fleet_->directory().on_news = [this, life = this->life()] {
    if (std::exchange(is_news_, true)) return;
    timeline_->after(0, [this, life] { when_running(life, [this] { poll_io(); }); });
  };
  fleet_->on_event = [this](const server::FleetEvent& event, std::int64_t now_ns) { take(event, now_ns); };
}

void ServerHost::take(const server::FleetEvent& event, std::int64_t now_ns) {
  using Kind = server::FleetEvent::Kind;
  journal_->mix(static_cast<std::uint64_t>(event.claim) + static_cast<std::uint64_t>(event.kind));
  if (event.kind == Kind::room_claimed) {
    server_->on_room_claimed(event.room, event.kept, now_ns);
  } else if (event.kind == Kind::room_lost) {
    journal_->count("room lost");
    lost_ns_[event.room] = timeline_->now_ns();
    server_->on_room_lost(event.room, now_ns);
  } else if (event.kind == Kind::grooms_passed_on) {
    journal_->count("grooms passed on", event.grooms.size());
    server_->prepare(event.grooms, now_ns);
  }
}

// Frames of a room may continue as soon as the directory owns it, which is before the server is notified.
void ServerHost::note_claims() {
  for (const std::string& room : directory().own_rooms()) {
    const std::int64_t claim = directory().where(room, clock_ns()).claim;
    if (std::exchange(claims_[room], claim) != claim && on_claimed) on_claimed(room, claim);
  }
}

void ServerHost::poll_fleet() {
  const std::int64_t now_ns = clock_ns();
  fleet_->poll(server_->takes_clients(), server_->largest_room(), now_ns);
  server_->set_overloaded_room(fleet_->overloaded_room());
  if (drained_since_ns_ < 0) return;
  const bool is_drained = server_->session_count() == 0 && connection_count() == 0;
  if (is_drained) fleet_->directory().stop(now_ns);
  const auto drain_ns = static_cast<std::int64_t>(config_.drain_s * 1e9);
  if ((is_drained && fleet_->directory().is_stopped()) || now_ns - drained_since_ns_ > drain_ns) kill({50 * kMs, -1});
}

void ServerHost::pause() {
  is_paused_ = true;
  stopped_ns_ = timeline_->now_ns();
  if (line_end_) line_end_->pause();
}

void ServerHost::resume() {
  if (!std::exchange(is_paused_, false)) return;
  stopped_ns_ = timeline_->now_ns();
  if (line_end_) line_end_->resume();
  for (const auto& action : std::exchange(waiting_, {})) action();
}

bool ServerHost::gave_up_since(const std::string& room, std::int64_t since_ns) const {
  const auto lost = lost_ns_.find(room);
  return is_paused_ || stopped_ns_ >= since_ns || (lost != lost_ns_.end() && lost->second >= since_ns);
}

template <class Action>
void ServerHost::when_running(int life, Action action) {
  if (!server_ || life != this->life()) return;
  if (is_paused_)
    waiting_.push_back([this, life, action = std::move(action)] { when_running(life, action); });
  else
    action();
}

void ServerHost::kill(const ConnectionLoss& how) {
  if (!server_) return;
  for (const std::weak_ptr<SimulatedConnection>& weak : connections_) {
    const auto wire = weak.lock();
    if (!wire) continue;
    wire->on_server_killed();
    ConnectionLoss one = how;
    one.client_announced_ns = static_cast<std::int64_t>(random_.unit() * static_cast<double>(how.client_announced_ns));
    one.server_announced_ns = -1;
    wire->break_now(one);
  }
  server_.reset();
  fleet_.reset();
  line_end_.reset();
  waiting_.clear();
  is_paused_ = false;
}

void ServerHost::drain() {
  if (!server_) return;
  stopped_ns_ = timeline_->now_ns();
  if (!fleet_) return server_->drain(0, clock_ns());
  drained_since_ns_ = clock_ns();
  server_->drain(std::min(kSendOnMax_ns, static_cast<std::int64_t>(config_.drain_s * 5e8)), clock_ns());
  fleet_->directory().drain(clock_ns());
}

std::int64_t ServerHost::clock_ns() const {
  if (lives_.empty()) return 0;
  const std::int64_t now_ns = timeline_->now_ns();
  return lives_.back().clock_offset_ns + now_ns +
         static_cast<std::int64_t>(static_cast<double>(now_ns) * (clock_rate_ - 1));
}

std::int64_t ServerHost::true_ns(int life, std::int64_t clock_ns) const {
  const std::int64_t since_ns = clock_ns - lives_.at(static_cast<std::size_t>(life)).clock_offset_ns;
  return since_ns + static_cast<std::int64_t>(static_cast<double>(since_ns) * (1 / clock_rate_ - 1));
}

server::PacketSink* ServerHost::open(std::shared_ptr<SimulatedConnection> wire) {
  std::erase_if(connections_, [](const auto& weak) { return weak.expired(); });
  connections_.push_back(wire);
  wire->set_life(life());
  server::Admission::Ticket ticket;
  const auto verdict = lives_.back().admission->enter(wire->address(), clock_ns(), ticket);
  if (verdict != server::Admission::Verdict::admitted) {
    journal_->count(verdict == server::Admission::Verdict::address_full ? "connection refused, too many of its address"
                                                                        : "connection refused, too soon");
    wire->close("refused");
    return nullptr;
  }
  ticket.move_to(server::Admission::Place::session);
  wire->keep(std::move(ticket));
  return server_->open(std::move(wire), clock_ns());
}

void ServerHost::poll_io() {
  is_news_ = false;
  if (fleet_) poll_fleet();
  // The fleet may have ended the server.
  if (!server_) return;
  server_->poll_io(clock_ns());
  check_bounds();
}

void ServerHost::run_io(int life) {
  poll_io();
  timeline_->after(kIoPeriod_ns, [this, life] { when_running(life, [this, life] { run_io(life); }); });
}

void ServerHost::run_tick(int life) {
  // A late tick runs as soon as the stall is over.
  const auto again = [this, life] { when_running(life, [this, life] { run_tick(life); }); };
  if (timeline_->now_ns() < stalled_until_ns_) return timeline_->at(stalled_until_ns_, again);
  reading_lasts_ns = work_ns_;
  if (server_->poll_tick(clock_ns())) {
    if (notes_) note_tick();
    check_shares();
    check_rates();
    const auto flush_in_ns = static_cast<std::int64_t>(random_.unit() * kFlush_ns_max);
    timeline_->after(flush_in_ns, [this, life] { when_running(life, [this] { server_->flush(clock_ns()); }); });
  }
  const std::int64_t wait_ns = server_->next_tick_ns() - clock_ns();
  // Threads wake up a little late: by 0.4 to 0.7 ms, and so after the frames of this tick are sent.
  timeline_->after(std::max<std::int64_t>(wait_ns, 0) + static_cast<std::int64_t>(kFlush_ns_max + random_.unit() * 3e5),
                   again);
}

void ServerHost::run_builder(int life) {
  building_ns_ = reading_lasts_ns = 0;
  server_->poll_builder();
  server_->poll_learner();
  timeline_->after(building_ns_ + static_cast<std::int64_t>(random_.between(5e6, 60e6)),
                   [this, life] { when_running(life, [this, life] { run_builder(life); }); });
}

void ServerHost::note_tick() {
  Life& life = lives_.back();
  const std::uint64_t number = server_->context().tick.load();
  if (number >= life.ticks.size()) life.ticks.resize(number + 1);
  Tick& tick = life.ticks[number];
  if (tick.ran_ns >= 0) fault("tick " + std::to_string(number) + " ran twice");
  tick.ran_ns = timeline_->now_ns();
  const Tick* before = nullptr;
  for (std::uint64_t n = number; n-- > 0 && !before;) {
    if (life.ticks[n].ran_ns >= 0) before = &life.ticks[n];
  }
  for (const auto& [session, observer] : server_->scheduler().rooms().observers()) {
    if (const int octaves = observer.throttle.coarser_octaves(); octaves > 0) tick.coarser_octaves[session] = octaves;
  }
  const Simulation& simulation = server_->scheduler().simulation();
  for (const auto& [key, character] : server_->scheduler().rooms().characters()) {
    if (!simulation.contains(key)) continue;
    const LatticeView lattice = simulation.lattice(key);
    GroundTruth& truth = tick.characters[key];
    if (before && lattice.asleep) {
      const auto last = before->characters.find(key);
      if (last != before->characters.end() && last->second.asleep) {
        truth = last->second;
        continue;
      }
    }
    truth.level = lattice.level;
    truth.asleep = lattice.asleep;
    truth.stepped = lattice.stepped;
    if (!is_valid(*lattice.pose)) fault("a pose in the World is not valid");
    truth.pose = as_frames_have_it(*lattice.pose);
    const auto is_finite = [](const Vec3f& v) { return v.allFinite(); };
    if (!std::ranges::all_of(lattice.displacement, is_finite)) fault("a lattice in the World is not finite");
    if (character.coefficients.tick() != number) continue;
    const std::span<const float> shown = character.coefficients.shown();
    truth.coefficients.assign(shown.begin(), shown.end());
    check_coefficients(number, key, lattice, truth);
  }
}

void ServerHost::check_coefficients(std::uint64_t number, server::CharacterKey key, const LatticeView& lattice,
                                    const GroundTruth& truth) {
  // A change of level fades out within 0.4 s (CoefficientTrack), during which frames carry a blend of both levels. The
  // rest of kFade_s is a reserve.
  constexpr double kFade_s = 0.5;
  // A change that nobody has seen begins to fade at the next frame that is sent.
  constexpr std::uint64_t kUnseen_ticks = 10;
  const auto fade_ticks = static_cast<std::uint64_t>(kFade_s * config_.tick_rate_hz) + kUnseen_ticks;
  const std::vector<Tick>& ticks = lives_.back().ticks;
  for (std::uint64_t n = number; n + fade_ticks > number; --n) {
    const auto past = ticks[n].characters.find(key);
    if (n == 0 || past == ticks[n].characters.end() || past->second.level != truth.level) return;
  }
  const std::shared_ptr<const LevelSet> levels =
      server_->scheduler().simulation().levels(server_->scheduler().rooms().characters().at(key).groom);
  if (!lattice.model || !levels) return;
  const ModeMap& map = levels->modes->map(lattice.level);
  if (!std::cmp_equal(map.matrix().cols(), 3 * lattice.displacement.size())) return;
  std::vector<float> wanted(levels->modes->basis.mode_count());
  map.coefficients_of(lattice.displacement, wanted);
  // The server sums up in another order when it does many characters at once.
  constexpr float kRounding_m = 1e-6f;
  const auto is_same = [](float a, float b) { return std::abs(a - b) <= kRounding_m; };
  std::vector<float> shown = truth.coefficients;
  // Coefficients that are missing are 0.
  shown.resize(wanted.size());
  if (!std::ranges::equal(wanted, shown, is_same)) fault("frames show another hair than the World has");
}

void ServerHost::check_bounds() {
  const server::SessionLimits& limits = config_.sessions;
  for (const auto& [id, session] : server_->sessions().all()) {
    const server::Outbox& outbox = session->outbox();
    if (outbox.control_bytes_waiting() > limits.control_bytes_max)
      fault("session " + std::to_string(id) + "'s outbox is beyond its bound of bytes");
    if (outbox.ticks_waiting() > server::Outbox::kTicksUnseenMax)
      fault("session " + std::to_string(id) + "'s outbox is beyond its bound of ticks");
  }
  check_sessions(limits);
  check_grooms();
  if (server_->scheduler().rooms().characters().size() > limits.character_count_max)
    fault("more characters than there may be");
  if (server_->scheduler().rooms().room_count() > limits.room_count_max) fault("more rooms than there may be");
  std::map<std::uint64_t, std::size_t> of_address;
  for (const auto& weak : connections_) {
    const auto wire = weak.lock();
    if (wire && wire->is_admitted() &&
        ++of_address[wire->address()] == config_.transport.admission.connections_per_address_max + 1)
      fault("more connections of one address than there may be");
  }
}

void ServerHost::check_sessions(const server::SessionLimits& limits) {
  // Sessions that have joined count, and as many that have sent no hello yet. A refused session stays until its goodbye
  // has been sent.
  const auto is_in_use = [](const auto& one) {
    return one.second->state() != server::Session::State::draining &&
           one.second->state() != server::Session::State::closed;
  };
  const auto in_use = std::ranges::count_if(server_->sessions().all(), is_in_use);
  if (server_->context().session_count > limits.session_count_max ||
      std::cmp_greater(in_use, 2 * limits.session_count_max))
    fault("more sessions than there may be");
  struct Count {
    std::size_t sessions = 0, characters = 0;
  };
  std::map<std::string, Count> of_subject;
  for (const auto& [id, session] : server_->sessions().all()) {
    if (!session->is_joined()) continue;
    Count& count = of_subject[session->identity().subject.name];
    ++count.sessions;
    count.characters += session->identity().characters.size();
  }
  const std::size_t sessions_max = std::max(limits.sessions_per_subject_max, limits.sessions_per_address_max);
  for (const auto& [subject, count] : of_subject) {
    if (count.sessions > sessions_max) fault("more sessions of " + subject + " than there may be");
    if (count.characters > limits.characters_per_subject_max)
      fault("more characters of " + subject + " than there may be");
  }
}

void ServerHost::check_grooms() {
  const server::GroomStoreLimits& limits = config_.grooms;
  const server::GroomStore& grooms = server_->grooms();
  if (grooms.upload_bytes() > limits.upload_bytes_max) fault("more bytes of uploads than there may be");
  if (grooms.groom_count() > limits.groom_count_max) fault("more grooms than there may be");
  const double waiting = lives_.back().metrics->groom.gauges.grooms_waiting.value();
  if (waiting > static_cast<double>(limits.build_queue_max + 1)) fault("more grooms wait to be built than may");
}

// Checks that rates are bounded however often clients ask. The wind of a room changes when the room opens and then a
// few times a second. The members of each observer are chosen by place at every eighth tick.
void ServerHost::check_rates() {
  constexpr std::uint64_t kWindsPer_s_max = 6, kTicksOfChoice = 8;
  const server::Metrics& m = *lives_.back().metrics;
  const std::uint64_t tick = server_->context().tick.load(), ticks = tick - rates_.tick;
  if (ticks < config_.tick_rate_hz) return;
  const Rates before =
      std::exchange(rates_, {tick, m.tick.winds_changed.value(), m.room.rooms_opened.value(),
                             m.room.rooms_closed.value(), m.tick.place_choices.value(),
                             m.session.sessions_welcomed.value(), server_->scheduler().rooms().observers().size()});
  const std::uint64_t opened = rates_.rooms_opened - before.rooms_opened;
  const std::uint64_t rooms = before.rooms_opened - before.rooms_closed + opened;
  if (rates_.winds - before.winds > opened + kWindsPer_s_max * ticks * rooms / config_.tick_rate_hz)
    fault("changes winds more often than it may");
  const std::uint64_t observers = before.observers + rates_.welcomed - before.welcomed;
  if (rates_.place_choices - before.place_choices > observers * (ticks / kTicksOfChoice + 2))
    fault("chooses members by place more often than it may");
}

// Checks that subjects share the time of ticks. While each of the many characters of one subject has more on average, a
// subject with few characters must not stay below the levels that it asks for.
void ServerHost::check_shares() {
  constexpr std::size_t kTimesAsMany = 4;
  struct Share {
    std::size_t count = 0, below = 0;
    double sum = 0;
  };
  std::map<std::uint32_t, Share> shares;
  for (const auto& [key, character] : server_->scheduler().rooms().characters()) {
    if (!character.in_world || !character.seen || character.asleep || character.requested_level == LevelIndex::rigid ||
        !server_->scheduler().simulation().has_levels(character.groom))
      continue;
    Share& share = shares[character.subject];
    ++share.count;
    // Learnt hair counts as low. The low level takes its place where nothing was learnt, or where the network does not
    // cover the motion.
    const auto as_stepped = [](LevelIndex level) { return level == LevelIndex::learnt ? LevelIndex::low : level; };
    const LevelIndex level = as_stepped(character.level);
    share.below += level > as_stepped(character.requested_level) || character.stride != 1;
    const int finer = static_cast<int>(LevelIndex::rigid) - static_cast<int>(level);
    if (finer > 0) share.sum += static_cast<double>(1 << finer) / character.stride;
  }
  const auto mean = [](const Share& share) { return share.sum / static_cast<double>(share.count); };
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> unfair_for;
  for (const auto& [few, of_few] : shares) {
    if (of_few.below == 0) continue;
    for (const auto& [many, of_many] : shares) {
      if (of_many.count < kTimesAsMany * of_few.count || mean(of_many) <= mean(of_few)) continue;
      const int ticks = unfair_for_[{few, many}] + 1;
      unfair_for[{few, many}] = ticks;
      if (ticks == kUnfair_s_max * static_cast<int>(config_.tick_rate_hz))
        fault("gives a subject of many characters more for each than one of few");
    }
  }
  unfair_for_ = std::move(unfair_for);
}

void ServerHost::check_empty() {
  if (!server_) return fault("is down at the end");
  const server::Server& server = *server_;
  const auto check = [&](const std::string& what, std::size_t count) {
    if (count != 0) fault("still has " + std::to_string(count) + " " + what + " when all have left");
  };
  check("connections", connection_count());
  check("sessions", server.session_count());
  check("sessions, counted by themselves,", server.context().session_count);
  check("characters, counted by sessions,", server.context().character_count);
  check("rooms, counted by sessions,", server.context().rooms.size());
  check("subjects, counted by sessions,", server.context().subjects.size());
  check("token holders, counted by sessions,", server.context().token_holders.size());
  check("users of grooms", server.grooms().user_count());
  check("bytes of uploads", server.grooms().upload_bytes());
  check("characters in the World", server.scheduler().simulation().character_count());
  check("characters in rooms", server.scheduler().rooms().characters().size());
  check("observers", server.scheduler().rooms().observers().size());
  check("rooms", server.scheduler().rooms().room_count());
  const server::Metrics& m = metrics(life());
  // In a fleet a groom may be prepared for a room that is to come here, and nobody uses it yet.
  const auto waiting = static_cast<std::size_t>(m.groom.gauges.grooms_waiting.value());
  check("grooms that wait to be built", fleet_ && waiting == 1 ? 0 : waiting);
  if (m.session.sessions_opened.value() != m.session.sessions_closed.value())
    fault("opened " + std::to_string(m.session.sessions_opened.value()) + " sessions and closed " +
          std::to_string(m.session.sessions_closed.value()));
  if (m.room.rooms_opened.value() != m.room.rooms_closed.value()) fault("opened and closed different numbers of rooms");
}

void ServerHost::check_counts(int life) {
  const server::Metrics& m = metrics(life);
  const server::SessionCounters& s = m.session;
  const server::RoomCounters& r = m.room;
  const std::uint64_t judged =
      s.poses_dropped_over_rate.value() + s.poses_dropped_busy.value() + s.poses_thinned.value() +
      s.poses_rejected_character.value() + s.poses_rejected_time.value() + s.poses_rejected_not_finite.value() +
      s.poses_rejected_not_unit.value() + s.poses_rejected_too_far.value() + r.poses_accepted.value() +
      r.poses_rejected_stale.value() + r.poses_rejected_out_of_order.value() + r.poses_rejected_future.value() +
      r.poses_rejected_unknown.value();
  if (judged != s.poses_received.value())
    fault("received " + std::to_string(s.poses_received.value()) + " poses and judged " + std::to_string(judged));
  if (s.frames_sent.value() + s.frames_superseded.value() > m.tick.frames_published.value())
    fault("sent more frames than it published");
  if (m.tick.frames_dropped_not_finite.value() > 0) fault("dropped frames that are not finite");
}

void ServerHost::count_life(int life) {
  for (const server::CounterSet* set : metrics(life).counter_sets()) {
    for (const server::Counter* counter : set->counters()) {
      if (counter->value() > 0)
        journal_->count("server: " + counter->name().flat() + (counter->name().scale == 1 ? "" : ", in ns"),
                        counter->value());
    }
  }
}

const GroundTruth* ServerHost::truth(int life, std::uint64_t tick, server::CharacterKey character) const {
  const auto& ticks = lives_.at(static_cast<std::size_t>(life)).ticks;
  if (tick >= ticks.size() || ticks[tick].ran_ns < 0) return nullptr;
  const auto found = ticks[tick].characters.find(character);
  return found == ticks[tick].characters.end() ? nullptr : &found->second;
}

// The throttle may change before or after a tick's frames are sent: at a loss before them, at the end of a byte window
// after them. The host notes it once a tick, so the larger of the last two notes counts.
int ServerHost::coarser_octaves(int life, std::uint64_t tick, server::SessionId session) const {
  const auto& ticks = lives_.at(static_cast<std::size_t>(life)).ticks;
  int most = 0;
  for (int noted = 0; noted < 2 && tick < ticks.size(); --tick) {
    if (ticks[tick].ran_ns >= 0) {
      ++noted;
      const auto found = ticks[tick].coarser_octaves.find(session);
      if (found != ticks[tick].coarser_octaves.end()) most = std::max(most, found->second);
    }
    if (tick == 0) break;
  }
  return most;
}

std::int64_t ServerHost::ran_ns(int life, std::uint64_t tick) const {
  const auto& ticks = lives_.at(static_cast<std::size_t>(life)).ticks;
  return tick < ticks.size() ? ticks[tick].ran_ns : -1;
}

}  // namespace hairnet::whole
