#include "tests/whole/fleet_scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <set>
#include <utility>

#include "schema/channel/silence.hpp"
#include "tests/whole/directory_scenario.hpp"
#include "tests/whole/owner_check.hpp"
#include "tests/whole/player.hpp"
#include "tests/whole/settled.hpp"

namespace hairnet::whole {
namespace {

// Every fourth seed has whole servers; the others have directories alone (directory_scenario.cpp).
constexpr std::uint64_t kSeedsPerWholeTrial = 4;
// Everything must recover within a lease and this time, which covers waits between attempts to connect (up to 5 s each,
// Backoff in client/link), uploads and builds.
constexpr std::int64_t kRecovery_ns_max = 20 * kSecond_ns;
// After a drain nobody waits for a lease, so everybody must have frames again earlier.
constexpr std::int64_t kDrainedMove_ns_max = 8 * kSecond_ns;
// The trial looks this often whether what it waits for has come.
constexpr std::int64_t kLook_ns = 50 * kMs;
// A server has fewer lives, so that each has its own number for OwnerCheck.
constexpr std::size_t kLivesMax = 1000;
// The ban lasts longer than any trial.
constexpr std::uint32_t kBan_s = 1000;
// Players who may not enter have this number and higher ones; the moderator has the number before it.
constexpr int kKeptOut = 50;
const std::string kModerator = "moderator";

// What can happen to the fleet. `late`: a server hears etcd late. `member_down`: one of etcd's members is down.
// `compaction`: etcd forgets its history. `lying`: answers of etcd are damaged or come twice. `broken_line` and
// `rejoin` happen to a player.
enum class FleetFault {
  cut,
  late,
  pause,
  kill,
  drain,
  etcd_down,
  member_down,
  compaction,
  bad_value,
  lying,
  broken_line,
  rejoin
};

// Several servers of a fleet, their etcd and clients, on one thread.
class FleetTrial {
 public:
  FleetTrial(std::uint64_t seed, bool is_verbose);
  Outcome run();

 private:
  server::Config make_config(std::size_t index) const;
  void make_servers(std::size_t count);
  std::unique_ptr<Player> make_player(int number, const std::string& room, const std::string& subject);
  void make_players();
  void plan_faults();
  void begin_fault(std::int64_t end_ns);
  void cut(ServerHost& host, std::int64_t end_ns);
  void late(ServerHost& host, std::int64_t end_ns);
  void bad_value(std::int64_t end_ns);
  void pause(ServerHost& host, std::int64_t end_ns);
  void kill(ServerHost& host, std::int64_t end_ns);
  void drain(ServerHost& host);
  void start_when_ended(ServerHost& host);
  void etcd_down(std::int64_t end_ns);
  void disturb(Player& player, bool leaves);
  void calm();
  void move_with_rules();
  void moderate(const std::string& room);
  void check_rules(const std::string& room, ServerHost& owner);
  void leave();
  void check_nothing_left();
  void stop_servers();

  // Runs until `error` is empty, and returns it.
  template <class Why>
  std::string run_until_well(std::int64_t until_ns, Why error);
  void run_until(std::int64_t time_ns);
  ServerHost* owner_of(const std::string& room);
  [[nodiscard]] std::string unsettled() const;
  [[nodiscard]] bool chance(double p) { return random_.unit() < p; }
  std::int64_t moment(std::int64_t from_ns, std::int64_t to_ns) {
    return from_ns + static_cast<std::int64_t>(random_.unit() * static_cast<double>(to_ns - from_ns));
  }
  void report(const std::string& what) const {
    if (is_verbose_) fmt::print(stderr, "{:.4f} s: {}\n", 1e-9 * static_cast<double>(timeline_.now_ns()), what);
  }

  bool is_verbose_;
  Random random_;
  Timeline timeline_;
  Journal journal_;
  EtcdLine line_;
  bool goes_on_;
  std::int64_t lease_s_ = 4, room_grace_ns_ = 0, resume_grace_ns_ = 0, disturbed_until_ns_ = 0;
  std::uint32_t tick_rate_hz_ = 30;
  double drain_s_ = 2;
  std::size_t endpoint_count_ = 1, groom_count_ = 1;
  std::vector<std::string> rooms_;
  std::vector<std::unique_ptr<ServerHost>> hosts_;
  OwnerCheck owners_;
  std::vector<std::unique_ptr<Player>> players_, kept_out_;
  std::unique_ptr<Player> moderator_;
  // The mean wind that each room must have. The air of other rooms is still.
  std::map<std::string, Vec3> winds_m_per_s_;
  // It is false once the players of `kept_out_` are banned or locked out.
  bool may_enter_ = true;
};

FleetTrial::FleetTrial(std::uint64_t seed, bool is_verbose)
    : is_verbose_(is_verbose),
      // The 78 keeps the random numbers apart from those of the other trials with this seed.
      random_(seed, 78),
      journal_(seed, timeline_),
      line_(timeline_, seed),
      goes_on_(random_.unit() < 0.25) {
  constexpr std::uint32_t kRates_hz[] = {10, 15, 20, 30};
  tick_rate_hz_ = kRates_hz[random_.next() % 4];
  // Short leases let a trial see their ends: a lease may have 2 s at least (config.cpp).
  lease_s_ = 3 + static_cast<std::int64_t>(random_.next() % 3);
  // A configuration in which servers go on without etcd needs a lease of at least 5 s.
  if (goes_on_) lease_s_ = 5;
  room_grace_ns_ = moment(0, kSecond_ns);
  resume_grace_ns_ = chance(0.1) ? 0 : moment(kSecond_ns / 2, 3 * kSecond_ns);
  drain_s_ = random_.between(1, 4);
  endpoint_count_ = 1 + random_.next() % 3;
  // Each server that starts encodes a basis for each groom, which takes half of a trial's time.
  groom_count_ = chance(0.7) ? 1 : 1 + random_.next() % 3;
  disturbed_until_ns_ = moment(6 * kSecond_ns, 12 * kSecond_ns);
  line_.loss = goes_on_ || chance(0.5) ? 0 : random_.between(0, 0.1);
  line_.clock_rate = 1 + 0.01 * random_.symmetric();
  line_.etcd.expiry_lag_s_max = chance(0.5) ? 0 : 1;
  line_.is_silent = chance(0.5);
  line_.slow_ns = moment(50 * kMs, goes_on_ ? 200 * kMs : kSecond_ns);
}

server::Config FleetTrial::make_config(std::size_t index) const {
  server::Config config;
  config.tick_rate_hz = tick_rate_hz_;
  config.workers = config.build_threads = 1;
  config.token_key_file = assets().token_key_file;
  config.room_grace_ns = room_grace_ns_;
  config.drain_s = drain_s_;
  // Learning is another trial's matter: it takes long.
  config.grooms.learning = server::Learning::never;
  config.fleet.address = fmt::format("server-{}", index);
  config.fleet.lease_s = lease_s_;
  config.fleet.without_etcd = goes_on_ ? server::WithoutEtcd::go_on : server::WithoutEtcd::stop;
  for (std::size_t i = 0; i < endpoint_count_; ++i)
    config.fleet.etcd.endpoints.push_back(fmt::format("http://etcd-{}", i));
  server::SessionLimits& limits = config.sessions;
  // All limits of time are shorter than the defaults, so that each can end within a trial.
  limits.handshake_timeout_ns = limits.idle_timeout_ns = 4 * kSecond_ns;
  limits.resume_grace_ns = resume_grace_ns_;
  limits.resume_interval_ns = 200 * kMs;
  limits.slow_consumer_ns = 3 * kSecond_ns;
  limits.drain_timeout_ns = 500 * kMs;
  return config;
}

void FleetTrial::make_servers(std::size_t count) {
  for (std::size_t index = 0; index < count; ++index) {
    hosts_.push_back(std::make_unique<ServerHost>(timeline_, journal_, make_config(index), random_.next()));
    ServerHost& host = *hosts_.back();
    host.join_fleet(line_, 1 + 0.01 * random_.symmetric());
    host.on_claimed = [this, index, &host](const std::string& room, std::int64_t claim) {
      journal_.count("room claimed");
      report(fmt::format("server-{} has claimed {}", index, room));
      owners_.claimed(kLivesMax * index + static_cast<std::size_t>(host.life()), room, claim, timeline_.now_ns());
    };
    // The servers of a fleet do not start at one time.
    timeline_.at(moment(0, kSecond_ns), [&host] { host.start(); });
  }
}

std::unique_ptr<Player> FleetTrial::make_player(int number, const std::string& room, const std::string& subject) {
  PlayerPlan plan;
  plan.number = number;
  plan.room = room;
  plan.token = assets().token(false, room, subject, subject == kModerator);
  plan.may_be_removed = number >= kKeptOut;
  plan.quality.delay_ns = moment(kMs, 40 * kMs);
  plan.quality.jitter_ns = chance(0.5) ? moment(0, 20 * kMs) : 0;
  if (chance(0.3)) {
    PathQuality path;
    path.delay_ns = plan.quality.delay_ns;
    path.loss = chance(0.5) ? 0.02 : 0;
    plan.quality.set_lossy(path, path, chance(0.75));
  }
  plan.pose_hz = random_.between(15, 40);
  plan.clock_offset_ns = moment(-1000 * kSecond_ns, 1'000'000 * kSecond_ns);
  // A player's clock is up to 200 parts per million too fast or too slow, and its time has nothing to do with a
  // server's.
  plan.clock_ppm = static_cast<int>(random_.next() % 401) - 200;
  plan.actions_per_s = random_.between(0.3, 2);
  plan.groom_count = groom_count_;
  // The server whose address the player knows, and asks first.
  const std::size_t known = random_.next() % hosts_.size();
  plan.find_server = [this, known](const std::optional<wire::ServerAt>& at) -> ServerHost& {
    if (at) {
      for (const auto& host : hosts_)
        if (host->config().fleet.address == at->host) return *host;
      journal_.fault("all", "are sent to a server that does not exist");
    }
    return *hosts_[known];
  };
  plan.on_frames = [this, number, room](const ServerHost& from, int life, std::int64_t stamp_ns) {
    const auto is_it = [&from](const auto& host) { return host.get() == &from; };
    const auto index = static_cast<std::size_t>(std::ranges::find_if(hosts_, is_it) - hosts_.begin());
    owners_.received(static_cast<std::size_t>(number), kLivesMax * index + static_cast<std::size_t>(life), room,
                     from.true_ns(life, stamp_ns), timeline_.now_ns());
  };
  return std::make_unique<Player>(timeline_, journal_, *hosts_[known], std::move(plan), random_.next());
}

void FleetTrial::make_players() {
  for (std::uint64_t n = 1 + random_.next() % 3; n > 0; --n) rooms_.push_back(fmt::format("room-{}", n));
  const int count = static_cast<int>(2 + random_.next() % 3);
  for (int n = 0; n < count; ++n) {
    const std::string& room = rooms_[n == 0 ? 0 : random_.next() % rooms_.size()];
    players_.push_back(make_player(n + 1, room, fmt::format("player {}", n + 1)));
    Player& player = *players_.back();
    timeline_.at(moment(0, disturbed_until_ns_ / 2), [this, &player] {
      player.join();
      player.add_character();
      player.act_at_random(disturbed_until_ns_);
    });
  }
}

void FleetTrial::plan_faults() {
  for (auto count = 2 + random_.next() % 6; count > 0; --count) {
    const std::int64_t begin_ns = moment(kSecond_ns, disturbed_until_ns_);
    // A fault lasts 0.2 to 8 s. Its logarithm is uniform, so short and long ones are equally common.
    const auto length_ns = static_cast<std::int64_t>(std::exp(random_.between(std::log(0.2), std::log(8))) * 1e9);
    timeline_.at(begin_ns,
                 [this, end_ns = std::min(begin_ns + length_ns, disturbed_until_ns_)] { begin_fault(end_ns); });
  }
}

void FleetTrial::begin_fault(std::int64_t end_ns) {
  using enum FleetFault;
  // Cuts and drains are there twice, so that they come twice as often.
  constexpr std::array kKinds{cut,       cut,         late,       pause,     kill,  drain,       drain,
                              etcd_down, member_down, compaction, bad_value, lying, broken_line, rejoin};
  FleetFault kind = kKinds[random_.next() % kKinds.size()];
  // With rooms that continue without etcd only failures that all servers see alike are harmless: a server that is cut
  // off alone keeps its rooms while another claims them.
  if (goes_on_ && (kind == cut || kind == late || kind == pause || kind == lying)) kind = etcd_down;
  ServerHost& host = *hosts_[random_.next() % hosts_.size()];
  Player& player = *players_[random_.next() % players_.size()];
  switch (kind) {
    case cut:
      return this->cut(host, end_ns);
    case late:
      return this->late(host, end_ns);
    case pause:
      return this->pause(host, end_ns);
    case kill:
      return this->kill(host, end_ns);
    case drain:
      return this->drain(host);
    case etcd_down:
      return this->etcd_down(end_ns);
    case member_down: {
      const std::size_t member = random_.next() % endpoint_count_;
      if (endpoint_count_ == 1 || !line_.dead_members.empty()) return;
      journal_.count("member of etcd down");
      line_.dead_members.insert(member);
      return timeline_.at(end_ns, [this, member] { line_.dead_members.erase(member); });
    }
    case compaction:
      journal_.count("compaction");
      if (!line_.etcd.is_down()) line_.etcd.compact();
      return;
    case bad_value:
      return this->bad_value(end_ns);
    case lying:
      journal_.count("damaged and repeated answers of etcd");
      line_.damaged = line_.repeated = 0.1;
      return timeline_.at(end_ns, [this] { line_.damaged = line_.repeated = 0; });
    case broken_line:
    case rejoin:
      return disturb(player, kind == rejoin);
  }
}

void FleetTrial::cut(ServerHost& host, std::int64_t end_ns) {
  if (host.is_ended() || !host.line_end().is_good()) return;
  static constexpr const char* kNames[] = {"", "server cut off from etcd", "server is not heard by etcd",
                                           "server does not hear etcd"};
  const std::uint64_t cut = 1 + random_.next() % 3;
  journal_.count(kNames[cut]);
  report(host.config().fleet.address + ": " + kNames[cut]);
  host.line_end().cut(static_cast<LineCut>(cut));
  timeline_.at(end_ns, [&host, life = host.life()] {
    if (!host.is_ended() && host.life() == life) host.line_end().cut(LineCut::none);
  });
}

void FleetTrial::late(ServerHost& host, std::int64_t end_ns) {
  if (host.is_ended() || !host.line_end().is_good()) return;
  journal_.count("server hears etcd late");
  report(host.config().fleet.address + " hears etcd late");
  // The delay is a third of the lease to a little more than the lease.
  host.line_end().make_late(moment(lease_s_ * kSecond_ns / 3, lease_s_ * kSecond_ns * 5 / 4));
  timeline_.at(end_ns, [&host, life = host.life()] {
    if (!host.is_ended() && host.life() == life) host.line_end().make_late(0);
  });
}

void FleetTrial::bad_value(std::int64_t end_ns) {
  if (line_.etcd.is_down()) return;
  journal_.count("bad value in etcd");
  const std::string key = chance(0.5) ? "servers/0000000000000001" : "kept/" + rooms_[random_.next() % rooms_.size()];
  report("a bad value in etcd: " + key);
  line_.put_bad_value("/hairnet/default/" + key, end_ns, random_);
}

void FleetTrial::pause(ServerHost& host, std::int64_t end_ns) {
  if (host.is_ended() || host.is_paused()) return;
  journal_.count("server paused");
  report(host.config().fleet.address + " is paused");
  host.pause();
  timeline_.at(end_ns, [this, &host, life = host.life()] {
    if (host.life() != life) return;
    report(host.config().fleet.address + " goes on");
    host.resume();
  });
}

void FleetTrial::kill(ServerHost& host, std::int64_t end_ns) {
  if (host.is_ended()) return;
  journal_.count("server killed");
  report(host.config().fleet.address + " is killed");
  host.count_life(host.life());
  // Clients notice the death of their server within 50 ms, as when its machine resets their connections, or within 2 s.
  // The server notices nothing any more.
  host.kill({chance(0.7) ? 50 * kMs : 2 * kSecond_ns, -1});
  timeline_.at(end_ns, [this, &host] {
    if (!host.is_ended()) return;
    report(host.config().fleet.address + " starts");
    host.start();
  });
}

void FleetTrial::drain(ServerHost& host) {
  if (!host.is_up() || host.is_paused()) return;
  journal_.count("server drained");
  report(host.config().fleet.address + " is drained");
  host.drain();
  start_when_ended(host);
}

void FleetTrial::start_when_ended(ServerHost& host) {
  // Another fault may have ended the server meanwhile, and it may run again.
  if (host.is_up()) return;
  if (!host.is_ended()) return timeline_.after(kLook_ns, [this, &host] { start_when_ended(host); });
  host.count_life(host.life());
  timeline_.after(moment(10 * kMs, kSecond_ns), [this, &host] {
    if (!host.is_ended()) return;
    report(host.config().fleet.address + " starts");
    host.start();
  });
}

void FleetTrial::etcd_down(std::int64_t end_ns) {
  if (line_.etcd.is_down()) return;
  journal_.count("etcd down");
  report("etcd is down");
  line_.etcd.go_down();
  for (const auto& host : hosts_)
    if (!host->is_ended()) host->line_end().break_streams();
  timeline_.at(end_ns, [this] {
    report("etcd is up");
    line_.come_up();
  });
}

void FleetTrial::disturb(Player& player, bool leaves) {
  if (!leaves) return player.break_connection({moment(0, 2 * kSecond_ns), moment(0, 2 * kSecond_ns)}, {}, false);
  player.leave(chance(0.5));
  timeline_.after(moment(10 * kMs, 1500 * kMs), [&player] { player.join(); });
}

void FleetTrial::run_until(std::int64_t time_ns) {
  timeline_.run(time_ns);
  for (const std::string& fault : owners_.take_faults()) journal_.fault("servers", fault);
  if (may_enter_) return;
  for (const auto& player : kept_out_)
    if (player->is_active()) journal_.fault(player->name(), "is in a room that it may not enter");
}

template <class Why>
std::string FleetTrial::run_until_well(std::int64_t until_ns, Why error) {
  std::string reason = error();
  while (!reason.empty() && timeline_.now_ns() < until_ns) {
    run_until(timeline_.now_ns() + kLook_ns);
    reason = error();
  }
  return reason;
}

std::string FleetTrial::unsettled() const {
  for (const auto& host : hosts_)
    if (!host->is_up()) return host->config().fleet.address + " is down";
  return whole::unsettled(players_, winds_m_per_s_);
}

// Ends all disturbances. Everybody must then have frames again within a lease and kRecovery_ns_max.
void FleetTrial::calm() {
  report("calm");
  line_.loss = line_.slow = line_.damaged = line_.repeated = 0;
  const auto why_older = [this]() -> std::string {
    const bool has_arrived =
        std::ranges::all_of(players_, [](const auto& player) { return player->has_all_arrived(); });
    return has_arrived ? "" : "something from before is on its way";
  };
  if (!run_until_well(timeline_.now_ns() + kRecovery_ns_max, why_older).empty())
    journal_.fault("all", "have sent what never arrives");
  for (const auto& player : players_) player->calm_down();
  const std::int64_t begun_ns = timeline_.now_ns(), bound_ns = lease_s_ * kSecond_ns + kRecovery_ns_max;
  if (const std::string error = run_until_well(begun_ns + bound_ns, [this] { return unsettled(); }); !error.empty())
    journal_.fault("all",
                   fmt::format("are not well {} s after the last disturbance: {}", bound_ns / kSecond_ns, error));
  journal_.count("ms until all are well", static_cast<std::uint64_t>((timeline_.now_ns() - begun_ns) / kMs));
  report(fmt::format("settled after {} ms", (timeline_.now_ns() - begun_ns) / kMs));
}

ServerHost* FleetTrial::owner_of(const std::string& room) {
  for (const auto& host : hosts_)
    if (!host->is_ended() && host->directory().holds(room, host->clock_ns())) return host.get();
  return nullptr;
}

// A moderator joins the room, and bans, mutes and locks there; a player sets the wind.
void FleetTrial::moderate(const std::string& room) {
  moderator_ = make_player(kKeptOut - 1, room, kModerator);
  moderator_->join();
  const auto error = [this]() -> std::string { return moderator_->is_active() ? "" : "is not let in"; };
  if (!run_until_well(timeline_.now_ns() + kRecovery_ns_max, error).empty())
    return journal_.fault("moderator", "is not let in");
  Wind wind;
  wind.mean_m_per_s = winds_m_per_s_[room] = {1.0 + static_cast<double>(random_.next() % 4), 0, 2};
  // A wind lasts as long as the person who has set it is in the room.
  players_.front()->send(wire::SetWind{wind});
  moderator_->send(wire::Moderate{wire::ModerateAction::remove, 0, "sub:banned", kBan_s});
  moderator_->send(wire::Moderate{wire::ModerateAction::mute, 0, "sub:muted", 0});
  moderator_->send(wire::Moderate{wire::ModerateAction::lock, 0, "", 0});
}

// Drains the server of a room with rules and a wind, or kills it some time after they were set. They must move with the
// room to its next server.
void FleetTrial::move_with_rules() {
  const std::string& room = rooms_[0];
  moderate(room);
  const bool is_drained = chance(0.7);
  run_until(timeline_.now_ns() + (is_drained ? moment(200 * kMs, 2 * kSecond_ns) : 2 * kSecond_ns));
  moderator_->leave(true);
  for (const char* subject : {"banned", "stranger"}) {
    kept_out_.push_back(make_player(kKeptOut + static_cast<int>(kept_out_.size()), room, subject));
    kept_out_.back()->join();
  }
  may_enter_ = false;
  ServerHost* const former = owner_of(room);
  if (!former) return journal_.fault("all", "have a room without a server");
  check_rules(room, *former);
  const std::int64_t begun_ns = timeline_.now_ns();
  if (is_drained)
    drain(*former);
  else
    kill(*former, begun_ns + moment(100 * kMs, 2 * kSecond_ns));
  const auto error = [&]() -> std::string {
    for (const auto& player : players_) {
      if (player->plan().room != room) continue;
      for (const auto& [number, member] : player->members())
        if (member.last_ns <= begun_ns) return player->name() + " has had no frame since";
    }
    if (const std::string unwell = unsettled(); !unwell.empty()) return unwell;
    return owner_of(room) ? "" : "the room has no server";
  };
  run_until(timeline_.now_ns() + kLook_ns);
  const std::int64_t bound_ns = is_drained ? kDrainedMove_ns_max : lease_s_ * kSecond_ns + kRecovery_ns_max;
  if (const std::string reason = run_until_well(begun_ns + bound_ns, error); !reason.empty())
    return journal_.fault("all", fmt::format("are not well {} s after a server {}: {}", bound_ns / kSecond_ns,
                                             is_drained ? "was drained" : "was killed", reason));
  journal_.count(is_drained ? "ms until all are well after a drain" : "ms until all are well after a kill",
                 static_cast<std::uint64_t>((timeline_.now_ns() - begun_ns) / kMs));
  check_rules(room, *owner_of(room));
}

// The room's server must know of the ban, the mute and the lock.
void FleetTrial::check_rules(const std::string& room, ServerHost& owner) {
  const server::RoomRules& rules = owner.server()->context().rules;
  const auto check = [&](bool holds, const char* what) {
    if (!holds) journal_.fault(owner.config().fleet.address, fmt::format("has no {} of {}", what, room));
  };
  check(rules.is_banned(room, "sub:banned", owner.clock_ns()), "ban");
  check(rules.is_muted(room, "sub:muted"), "mute");
  check(rules.is_locked(room), "lock");
  journal_.count("rules looked at");
}

// All leave, half of them without a goodbye. Then the longest time passes after which a server may still have something
// of them.
void FleetTrial::leave() {
  report("all leave");
  for (auto* const some : {&players_, &kept_out_})
    for (const auto& player : *some)
      timeline_.after(moment(0, 500 * kMs), [this, &player] { player->leave(chance(0.5)); });
  const server::SessionLimits& limits = hosts_[0]->config().sessions;
  run_until(timeline_.now_ns() + kSecond_ns + std::max(limits.idle_timeout_ns, channel::kSilence_ns) +
            limits.drain_timeout_ns + resume_grace_ns_ + room_grace_ns_ + 4 * kSecond_ns);
}

void FleetTrial::check_nothing_left() {
  for (const auto& host : hosts_) {
    host->check_empty();
    if (host->is_ended()) continue;
    const std::string& name = host->config().fleet.address;
    if (!host->directory().own_rooms().empty()) journal_.fault(name, "has rooms that nobody is in");
    if (host->server()->context().rules.entry_count() != 0) journal_.fault(name, "has rules of rooms that have ended");
    if (!host->server()->context().winds.empty()) journal_.fault(name, "has winds of rooms that have ended");
    host->check_counts(host->life());
    host->count_life(host->life());
  }
  for (const std::string& key : line_.etcd.keys())
    if (key.find("/rooms/") != std::string::npos) journal_.fault("etcd", "still has " + key);
}

void FleetTrial::stop_servers() {
  for (const auto& host : hosts_)
    if (!host->is_ended()) host->drain();
  run_until(timeline_.now_ns() + static_cast<std::int64_t>(drain_s_ * 1e9) + kSecond_ns);
  for (const auto& host : hosts_)
    if (!host->is_ended()) journal_.fault(host->config().fleet.address, "has not ended");
  // A ban outlives its room, so etcd still has what was kept of the moderated one.
  for (const std::string& key : line_.etcd.keys())
    if (!key.ends_with("/kept/" + rooms_[0])) journal_.fault("etcd", "still has " + key);
  if (line_.etcd.watch_count() != 0) journal_.fault("etcd", "still has a watch");
}

Outcome FleetTrial::run() {
  seed_secrets(random_.next());
  make_servers(2 + random_.next() % 3);
  make_players();
  line_.keep_time();
  plan_faults();
  run_until(disturbed_until_ns_ + kMs);
  calm();
  move_with_rules();
  leave();
  check_nothing_left();
  stop_servers();
  for (const auto& player : players_) player->finish();
  journal_.count("whole servers", hosts_.size());
  journal_.count("owners of rooms, by frames", owners_.owners);
  journal_.count("packets of frames", owners_.packets);
  return {journal_.faults(), journal_.events(), journal_.hash(), 1e-9 * static_cast<double>(timeline_.now_ns())};
}

}  // namespace

Outcome run_fleet_scenario(std::uint64_t seed, bool is_verbose) {
  if (seed % kSeedsPerWholeTrial != kSeedsPerWholeTrial / 2) return run_directory_scenario(seed, is_verbose);
  assets();
  return FleetTrial(seed, is_verbose).run();
}

}  // namespace hairnet::whole
