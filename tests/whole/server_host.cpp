#include "tests/whole/server_host.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::whole {
namespace {

constexpr std::int64_t kIoPeriod_ns = 20 * kMs;
constexpr double kFlush_ns_max =
    4e5;  // from a tick's end to its frames being taken: before the next one, even if that is late

// Measures nothing but how often it was read: the same in every run.
thread_local std::int64_t measured_ns = 0, reading_lasts_ns = 0;
std::int64_t measure_ns() {
  return measured_ns += reading_lasts_ns;
}

}  // namespace

ServerHost::ServerHost(Timeline& timeline, Journal& journal, const server::Config& config, std::uint64_t seed)
    : timeline_(&timeline), journal_(&journal), config_(config), random_(seed, 2) {}

void ServerHost::start() {
  Life& life = lives_.emplace_back();
  life.metrics = std::make_unique<server::Metrics>();
  life.clock_offset_ns = static_cast<std::int64_t>(random_.between(0, 1e15));
  auto created = server::Server::create(config_, *life.metrics, clock_ns(), measure_ns);
  if (!created) return journal_->fault("server", "does not start: " + created.error());
  server_ = std::move(*created);
  connections_.clear();
  const int number = this->life();
  run_io(number);
  run_tick(number);
  run_builder(number);
}

void ServerHost::kill(const ConnectionLoss& how) {
  if (!server_) return;
  for (const std::weak_ptr<SimulatedConnection>& weak : connections_) {
    const auto wire = weak.lock();
    if (!wire) continue;
    wire->on_server_killed();
    ConnectionLoss one = how;
    one.client_told_ns = static_cast<std::int64_t>(random_.unit() * static_cast<double>(how.client_told_ns));
    one.server_told_ns = -1;
    wire->break_now(one);
  }
  server_.reset();
}

void ServerHost::drain() {
  if (server_) server_->drain(clock_ns());
}

std::int64_t ServerHost::clock_ns() const {
  return lives_.empty() ? 0 : timeline_->now_ns() + lives_.back().clock_offset_ns;
}

server::PacketSink* ServerHost::open(std::shared_ptr<SimulatedConnection> wire) {
  std::erase_if(connections_, [](const auto& weak) { return weak.expired(); });
  connections_.push_back(wire);
  wire->set_life(life());
  return server_->open(std::move(wire), clock_ns());
}

void ServerHost::run_io(int life) {
  if (!server_ || life != this->life()) return;
  server_->poll_io(clock_ns());
  check_bounds();
  timeline_->after(kIoPeriod_ns, [this, life] { run_io(life); });
}

void ServerHost::run_tick(int life) {
  if (!server_ || life != this->life()) return;
  if (timeline_->now_ns() < stalled_until_ns_)
    return timeline_->at(stalled_until_ns_, [this, life] { run_tick(life); });
  reading_lasts_ns = work_ns_;
  if (server_->poll_tick(clock_ns())) {
    note_tick();
    const auto flush_in_ns = static_cast<std::int64_t>(random_.unit() * kFlush_ns_max);
    timeline_->after(flush_in_ns, [this, life] {
      if (server_ && life == this->life()) server_->flush(clock_ns());
    });
  }
  const std::int64_t wait_ns = server_->next_tick_ns() - clock_ns();
  timeline_->after(std::max<std::int64_t>(wait_ns, 0) + static_cast<std::int64_t>(kFlush_ns_max + random_.unit() * 3e5),
                   [this, life] { run_tick(life); });
}

void ServerHost::run_builder(int life) {
  if (!server_ || life != this->life()) return;
  server_->poll_builder();
  timeline_->after(static_cast<std::int64_t>(random_.between(5e6, 60e6)), [this, life] { run_builder(life); });
}

void ServerHost::note_tick() {
  Life& life = lives_.back();
  const std::uint64_t number = server_->context().tick.load();
  if (number >= life.ticks.size()) life.ticks.resize(number + 1);
  Tick& tick = life.ticks[number];
  if (tick.ran_ns >= 0) journal_->fault("server", "tick " + std::to_string(number) + " ran twice");
  tick.ran_ns = timeline_->now_ns();
  const Tick* before = nullptr;
  for (std::uint64_t n = number; n-- > 0 && !before;) {
    if (life.ticks[n].ran_ns >= 0) before = &life.ticks[n];
  }
  const server::Simulation& simulation = server_->scheduler().simulation();
  std::vector<std::int16_t> integers;
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
    truth.pose = *lattice.pose;
    if (!is_valid(truth.pose)) journal_->fault("server", "a pose in the World is not valid");
    const auto is_finite = [](const Vec3f& v) { return v.allFinite(); };
    if (!std::ranges::all_of(lattice.displacement, is_finite))
      journal_->fault("server", "a lattice in the World is not finite");
    for (std::size_t c = 0; lattice.model && c < codec::kErrorClassCount; ++c) {
      const auto error_class = static_cast<codec::ErrorClass>(c);
      codec::quantise_nodes(lattice.displacement, error_class, integers);
      truth.nodes[c] = hash_of(integers);
      codec::quantise_velocities(simulation.velocity(key), error_class, integers);
      truth.velocities[c] = hash_of(integers);
    }
  }
}

void ServerHost::check_bounds() {
  const server::SessionLimits& limits = config_.sessions;
  for (const auto& [id, session] : server_->sessions().all()) {
    const server::Outbox& outbox = session->outbox();
    if (outbox.control_bytes_waiting() > limits.control_bytes_max)
      journal_->fault("server", "session " + std::to_string(id) + "'s outbox is beyond its bound of bytes");
    if (outbox.ticks_waiting() > server::Outbox::kTicksUnseenMax)
      journal_->fault("server", "session " + std::to_string(id) + "'s outbox is beyond its bound of ticks");
  }
  if (server_->context().session_count > limits.session_count_max ||
      server_->session_count() > 2 * limits.session_count_max)
    journal_->fault("server", "more sessions than there may be");
  if (server_->scheduler().rooms().characters().size() > limits.character_count_max)
    journal_->fault("server", "more characters than there may be");
}

const GroundTruth* ServerHost::truth(int life, std::uint64_t tick, server::CharacterKey character) const {
  const auto& ticks = lives_.at(static_cast<std::size_t>(life)).ticks;
  if (tick >= ticks.size() || ticks[tick].ran_ns < 0) return nullptr;
  const auto found = ticks[tick].characters.find(character);
  return found == ticks[tick].characters.end() ? nullptr : &found->second;
}

std::int64_t ServerHost::ran_ns(int life, std::uint64_t tick) const {
  const auto& ticks = lives_.at(static_cast<std::size_t>(life)).ticks;
  return tick < ticks.size() ? ticks[tick].ran_ns : -1;
}

}  // namespace hairnet::whole
