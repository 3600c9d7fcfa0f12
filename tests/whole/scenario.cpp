#include "tests/whole/scenario.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>
#include <utility>

#include "schema/channel/silence.hpp"
#include "tests/whole/bad_client.hpp"
#include "tests/whole/player.hpp"
#include "tests/whole/settled.hpp"

namespace hairnet::whole {
namespace {

// The longest time until everything has recovered, beside the time for what lines have buffered. Clients wait up to 5 s
// between attempts to connect, so this leaves room for several attempts.
constexpr std::int64_t kSettle_ns_max = 20 * kSecond_ns;
// All heads move for this time before check_motion() looks at the age of the last frames.
constexpr std::int64_t kMotion_ns = 1200 * kMs;
// The most bytes of levels and bases that a client is sent when grooms are ready. Frames wait behind them.
constexpr std::size_t kBases_bytes = 40'000;
// The longest time from the last motion of a head until all hair has come to rest.
constexpr std::int64_t kRest_ns_max = 20 * kSecond_ns;

std::string described(const NetworkQuality& quality) {
  if (!quality.lossy) return "";
  const auto described_path = [](const PathQuality& path) {
    return std::to_string(std::llround(100 * path.loss)) + " % lost, " +
           std::to_string(std::llround(100 * path.reorder)) + " % overtaken, " + std::to_string(path.delay_ns / kMs) +
           " ms, " + std::to_string(std::llround(path.bytes_per_s)) + " bytes/s";
  };
  return std::string(quality.lossy->has_datagrams ? ", datagrams, up " : ", up ") + described_path(quality.lossy->up) +
         ", down " + described_path(quality.lossy->down);
}

// Runs one seed: makes a server, players and bad clients, disturbs them for some seconds, then checks that everything
// recovers, that hair moves and comes to rest, and that the server is empty when all have left.
class Scenario {
 public:
  Scenario(std::uint64_t seed, bool is_verbose) : seed_(seed), says_all_(is_verbose), random_(seed, 0) {}
  ~Scenario() { forget_levels(); }
  Outcome run();

 private:
  server::Config make_config();
  NetworkQuality make_quality();
  void make_lossy(NetworkQuality& quality);
  void make_players();
  void choose_misbehaviours();
  void make_bad_clients();
  void make_bad_group(Misbehaviour kind, std::uint64_t address);
  [[nodiscard]] std::string token_for(const std::string& room, const std::string& subject) const;
  void disturb();
  void disturb_one(Player& player);
  void restart_server();
  void calm();
  void check_motion();
  [[nodiscard]] std::int64_t owner_heard_ns(const Player::Member& member) const;
  void check_rest();
  void leave();
  [[nodiscard]] std::string unsettled();
  static double backlog_s(const Player& player);
  bool all_rest();

  void forget_levels() const {
    std::error_code ignored;
    if (!config_.level_cache.empty()) std::filesystem::remove_all(config_.level_cache, ignored);
  }
  [[nodiscard]] bool chance(double p) { return random_.unit() < p; }
  void report(const std::string& what) const {
    if (says_all_) std::fprintf(stderr, "%.4f s: %s\n", 1e-9 * static_cast<double>(timeline_.now_ns()), what.c_str());
  }
  // Picks a random time between both.
  std::int64_t moment(std::int64_t from_ns, std::int64_t to_ns) {
    return from_ns + static_cast<std::int64_t>(random_.unit() * static_cast<double>(to_ns - from_ns));
  }

  std::uint64_t seed_;
  bool says_all_;
  Random random_;
  Timeline timeline_;
  Journal journal_{seed_, timeline_};
  server::Config config_;
  std::vector<std::string> rooms_;
  std::unique_ptr<ServerHost> host_;
  std::vector<std::unique_ptr<Player>> players_;
  std::vector<std::unique_ptr<BadClient>> bad_clients_;
  std::int64_t disturbed_until_ns_ = 0;
  bool has_touch_ = false, has_worst_lines_ = false, wants_tokens_ = false, tokens_have_subjects_ = false;
  // One entry for each group of bad clients.
  std::vector<Misbehaviour> misbehaviours_;
};

// Makes limits so small that bad clients reach them and players do not, and chooses the others at random.
server::Config Scenario::make_config() {
  server::Config config;
  constexpr std::uint32_t kRates_hz[] = {10, 15, 20, 30};
  config.tick_rate_hz = kRates_hz[random_.next() % 4];
  config.pose_delay_ms = random_.between(0, 60);
  config.workers = config.build_threads = 1;
  config.ticks_behind_max = static_cast<std::uint32_t>(1 + random_.next() % 4);
  // A folder for this trial alone, empty at first: files of other trials would be counted.
  if (chance(0.5)) config.level_cache = assets().level_cache + "/" + std::to_string(seed_);
  // A stream of its own, so that scenarios without touch are as they would be without this line.
  has_touch_ = Random(seed_, 300).unit() < 0.4;
  if (has_touch_) config.sessions.props_from_clients = server::AllowedClients::participants;
  has_worst_lines_ = chance(0.4);
  wants_tokens_ = chance(0.3);
  tokens_have_subjects_ = chance(0.6);
  if (wants_tokens_) config.token_key_file = assets().token_key_file;
  config.room_grace_ns = moment(0, kSecond_ns);
  server::SessionLimits& limits = config.sessions;
  // Players have up to 3 characters each, and there are up to 5 players, so the limits of characters are beyond what
  // they use.
  limits.session_count_max = chance(0.3) ? 8 : 64;
  limits.character_count_max = 192;
  limits.characters_per_session_max = 16;
  limits.characters_per_subject_max = 24;
  limits.sessions_per_subject_max = limits.sessions_per_address_max = 6;
  limits.control_bytes_max = chance(0.3) ? 200'000 : std::size_t{32} << 20;
  limits.frame_packet_bytes_max = chance(0.3) ? 400 : std::size_t{256} << 10;
  limits.room_count_max = 8;
  limits.messages_per_s = 300;
  limits.messages_burst = 600;
  limits.poses_per_s = 1000;
  limits.poses_burst = 1000;
  limits.handshake_timeout_ns = kSecond_ns;
  // Lines that lose a fifth of their packets stall for seconds, so time-outs are longer where there may be such lines
  // (has_worst_lines_).
  limits.idle_timeout_ns = (has_worst_lines_ ? 12 : 4) * kSecond_ns;
  limits.resume_grace_ns = chance(0.1) ? 0 : moment(kSecond_ns / 2, 3 * kSecond_ns);
  limits.resume_interval_ns = 200 * kMs;
  limits.slow_consumer_ns = (has_worst_lines_ ? 5 : 1) * moment(kSecond_ns, 2 * kSecond_ns);
  limits.drain_timeout_ns = 500 * kMs;
  limits.downloads_per_session_max = 4;
  server::GroomStoreLimits& grooms = config.grooms;
  grooms.groom_bytes_max = 256 << 10;
  grooms.upload_bytes_max = 1 << 20;
  grooms.upload_burst_bytes = 512 << 10;
  grooms.upload_bytes_per_s = 128 << 10;
  // The grooms of a trial have some kilobytes (assets.cpp), so these bounds of uploads are met by players and not by
  // those that trickle or heap.
  grooms.upload_bytes_per_s_min = 512;
  // A slow line full of poses takes seconds for a chunk.
  grooms.upload_timeout_ns = 8 * kSecond_ns;
  grooms.upload_patience_ns = 300 * kMs;
  grooms.groom_count_max = 24;
  grooms.grooms_per_session_max = 8;
  grooms.build_queue_max = 6;
  // Hair is learnt only where the tick rate is 30 Hz (is_learnt_tick); at the other rates this changes nothing.
  grooms.learning = chance(0.5) ? server::Learning::always : server::Learning::never;
  // Costly grooms (Assets::costly) exceed both bounds of a build.
  grooms.build_ns_max = 300 * kMs;
  grooms.build_memory_bytes_max = std::size_t{35} << 20;
  server::AdmissionLimits& admission = config.transport.admission;
  admission.connections_per_address_max = 8;
  admission.connections_per_address_per_s = 10;
  admission.connections_per_address_burst = 30;
  return config;
}

// Some lines are slow, some have small windows or buffers, and some cut the stream into small pieces: each is a reason
// for waiting that code may have forgotten.
NetworkQuality Scenario::make_quality() {
  NetworkQuality quality;
  quality.delay_ns = moment(kMs / 2, 60 * kMs);
  quality.jitter_ns = chance(0.5) ? moment(0, 40 * kMs) : 0;
  quality.bytes_per_s = chance(0.2) ? random_.between(4e4, 4e5) : 1e7;
  quality.window_bytes = chance(0.3) ? 3000 : 64u << 10;
  quality.segment_bytes_max = chance(0.2) ? 200 : 1460 * 8;
  quality.unsent_bytes_max = chance(0.2) ? 4000 : 64u << 10;
  quality.in_small_pieces = chance(0.15);
  return quality;
}

// Makes the line lose packets. Three of four such lines carry WebTransport, the others TCP. The last entries of kLosses
// and kReorders are those of the worst lines.
void Scenario::make_lossy(NetworkQuality& quality) {
  constexpr double kLosses[] = {0, 0.01, 0.05, 0.2}, kReorders[] = {0, 0, 0.04, 0.3};
  const bool has_datagrams = chance(0.75), is_far = has_datagrams && chance(0.4);
  // A far line with the worst losses carries less than a session needs, and a near one stalls for seconds.
  const bool may_be_worst = has_worst_lines_ && has_datagrams && !is_far;
  const auto make_path = [&] {
    PathQuality path;
    path.delay_ns = is_far ? moment(60 * kMs, 200 * kMs) : moment(0, 60 * kMs);
    path.jitter_ns = chance(0.5) ? moment(0, 40 * kMs) : 0;
    path.loss = kLosses[random_.next() % (may_be_worst ? 4 : 3)];
    path.burst_ns = chance(0.4) ? moment(10 * kMs, 200 * kMs) : 0;
    path.reorder = kReorders[random_.next() % (may_be_worst ? 4 : 3)];
    path.duplicate = chance(0.3) ? 0.05 : 0;
    path.bytes_per_s = chance(0.2) ? random_.between(8e4, 4e5) : 1e7;
    path.queue_bytes_max = chance(0.3) ? 8u << 10 : 64u << 10;
    return path;
  };
  const PathQuality up = make_path();
  quality.set_lossy(up, make_path(), has_datagrams);
}

void Scenario::make_players() {
  for (std::uint64_t r = 1 + random_.next() % 3; r > 0; --r) rooms_.push_back(r == 1 ? "" : "room" + std::to_string(r));
  const int count = static_cast<int>(2 + random_.next() % 4);
  for (int n = 0; n < count; ++n) {
    PlayerPlan plan;
    plan.number = n + 1;
    plan.room = rooms_[random_.next() % rooms_.size()];
    plan.token = token_for(plan.room, "player " + std::to_string(plan.number));
    plan.quality = make_quality();
    if (chance(0.5)) make_lossy(plan.quality);
    plan.pose_hz = random_.between(20, 70);
    // The clocks of clients have nothing to do with the server's.
    plan.clock_offset_ns = moment(-1000 * kSecond_ns, 1'000'000 * kSecond_ns);
    // Clocks of clients run up to 200 ppm too fast or too slow.
    plan.clock_ppm = static_cast<int>(random_.next() % 401) - 200;
    // The first player has a good line, and disturbances of single players spare it. It must miss nothing, whatever
    // other clients do.
    plan.steady = n == 0;
    plan.sends_garbage = !plan.steady && chance(0.3);
    plan.actions_per_s = random_.between(0.3, 3);
    plan.touches = has_touch_ && Random(seed_, 301 + static_cast<std::uint64_t>(n)).unit() < 0.7;
    if (plan.steady) {
      plan.quality = {};
      plan.quality.delay_ns = moment(kMs, 10 * kMs);
      plan.quality.jitter_ns = 2 * kMs;
      plan.pose_hz = 60;
      // Each of the other clients' addresses may be asked for the groom first, and have a build.
      const server::GroomStoreLimits& grooms = config_.grooms;
      plan.groom_wait_ns_max =
          kSecond_ns + static_cast<std::int64_t>(static_cast<std::size_t>(count) + misbehaviours_.size()) *
                           (grooms.upload_patience_ns + grooms.build_ns_max);
    }
    players_.push_back(std::make_unique<Player>(timeline_, journal_, *host_, plan, seed_));
    Player& player = *players_.back();
    timeline_.at(plan.steady ? moment(0, kSecond_ns / 2) : moment(0, disturbed_until_ns_ / 2), [this, &player] {
      journal_.count(player.has_datagrams()        ? "players over datagrams"
                     : player.plan().quality.lossy ? "players over lossy streams"
                                                   : "players over streams");
      report(player.name() + " joins, over " + std::to_string(std::llround(player.plan().quality.min_bytes_per_s())) +
             " bytes/s" + described(player.plan().quality));
      player.join();
      player.add_character();
      if (!player.plan().steady && chance(0.5)) player.add_character();
      player.act_at_random(disturbed_until_ns_);
    });
  }
}

std::string Scenario::token_for(const std::string& room, const std::string& subject) const {
  return wants_tokens_ ? assets().token(false, room, tokens_have_subjects_ ? subject : "") : std::string();
}

// Chooses up to three kinds of bad clients. It comes before make_players(), whose waiting times depend on the number of
// kinds.
void Scenario::choose_misbehaviours() {
  for (auto count = chance(0.25) ? 0 : 1 + random_.next() % 3; count > 0; --count) {
    const auto kind = static_cast<Misbehaviour>(random_.next() % kMisbehaviourNames.size());
    if (std::ranges::find(misbehaviours_, kind) == misbehaviours_.end()) misbehaviours_.push_back(kind);
    // Such a client stalls for longer than the time-out of the upload.
    if (kind == Misbehaviour::groom_trickler)
      disturbed_until_ns_ = std::max(disturbed_until_ns_, config_.grooms.upload_timeout_ns + 2 * kSecond_ns);
  }
}

// The clients of one kind share a room, an address and a token.
void Scenario::make_bad_group(Misbehaviour kind, std::uint64_t address) {
  const auto one_to = [this](std::uint64_t max) { return 1 + static_cast<int>(random_.next() % max); };
  const bool is_many = kind == Misbehaviour::silent || kind == Misbehaviour::rejoiner;
  const bool is_some = kind == Misbehaviour::groom_trickler || kind == Misbehaviour::hoarder ||
                       kind == Misbehaviour::drip_reader || kind == Misbehaviour::resumer;
  // 5 to 12 clients fill what a server has for connections; 2 to 4 are enough to take turns, or to read what the others
  // cause.
  const int count = is_many ? 4 + one_to(8) : is_some ? 1 + one_to(3) : 1;
  const std::string room = kind == Misbehaviour::hoarder ? "hoard" : rooms_[random_.next() % rooms_.size()];
  for (int n = 0; n < count; ++n) {
    BadClientPlan plan;
    plan.number = static_cast<int>(bad_clients_.size()) + 1;
    plan.address = address;
    // The observers of this group read slowly, so one client must produce a lot for them to read.
    plan.kind = kind == Misbehaviour::drip_reader && n == 0 ? Misbehaviour::shuffler : kind;
    plan.room = room;
    plan.token = token_for(room, "group " + std::to_string(address));
    plan.quality = make_quality();
    if (chance(sends_bad_datagrams(kind) ? 0.8 : 0.2)) make_lossy(plan.quality);
    if (plan.kind == Misbehaviour::drip_reader) {
      plan.quality.bytes_per_s = 1000;
      plan.quality.window_bytes = plan.quality.unsent_bytes_max = 500;
    }
    bad_clients_.push_back(std::make_unique<BadClient>(timeline_, journal_, *host_, plan, seed_));
    BadClient& bad_client = *bad_clients_.back();
    // This kind must offer its groom before the players do.
    const bool is_first = kind == Misbehaviour::groom_trickler;
    timeline_.at(is_first ? 0 : moment(0, disturbed_until_ns_ / 2),
                 [this, &bad_client] { bad_client.start(disturbed_until_ns_); });
  }
}

void Scenario::make_bad_clients() {
  // Players have the addresses before this one.
  constexpr std::uint64_t kFirstAddress = 100;
  for (std::size_t n = 0; n < misbehaviours_.size(); ++n) make_bad_group(misbehaviours_[n], kFirstAddress + n);
}

void Scenario::disturb_one(Player& player) {
  // The values 0 to 2 break the connection in time, 3 to 5 break it at a byte, 6 and 7 let the player leave and join
  // again.
  const std::uint64_t pick = random_.next() % 8;
  const auto delay_ns = [&] { return static_cast<std::int64_t>(random_.between(0, chance(0.5) ? 5e7 : 2.5e9)); };
  // The two ends notice the loss after different times, up to 2.5 s. A negative time means that the server never
  // notices.
  const ConnectionLoss how{delay_ns(), chance(0.3) ? -1 : delay_ns()};
  report("disturbs " + player.name() + " by " + std::to_string(pick));
  if (pick <= 2) {
    player.break_connection(how, {}, false);
  } else if (pick <= 5) {
    player.break_connection(how, random_.next() % 3000, chance(0.5));
  } else {
    player.leave(pick == 6);
    timeline_.after(moment(10 * kMs, 1500 * kMs), [this, &player] {
      report(player.name() + " joins again");
      player.join();
    });
  }
}

void Scenario::restart_server() {
  const bool drained = chance(0.4);
  report(drained ? "server is stopped" : "server is killed");
  journal_.count(drained ? "server stopped" : "server killed");
  if (drained) host_->drain();
  const std::int64_t down_ns = moment(10 * kMs, 1200 * kMs);
  // Clients notice a killed server soon, or only after 2 s.
  const std::int64_t announced_ns = chance(0.7) ? 50 * kMs : 2 * kSecond_ns;
  timeline_.after(drained ? 300 * kMs : 0, [this, announced_ns, down_ns] {
    host_->count_life(host_->life());
    host_->kill({announced_ns, -1});
    timeline_.after(down_ns, [this] {
      report("server starts");
      host_->start();
    });
  });
}

void Scenario::disturb() {
  const double per_s = chance(0.2) ? 0 : random_.between(0.2, 2);
  const auto count = static_cast<int>(per_s * 1e-9 * static_cast<double>(disturbed_until_ns_));
  for (int i = 0; i < count; ++i) {
    timeline_.at(moment(0, disturbed_until_ns_), [this] {
      Player& player = *players_[random_.next() % players_.size()];
      if (!player.plan().steady) disturb_one(player);
    });
  }
  if (chance(0.1)) {
    // All connections break at once: a router restarts.
    timeline_.at(moment(kSecond_ns, disturbed_until_ns_), [this] {
      journal_.count("all connections broken");
      for (const auto& player : players_)
        player->break_connection({static_cast<std::int64_t>(random_.between(0, 2e8)), 50 * kMs}, {}, false);
    });
  }
  if (chance(0.25)) timeline_.at(moment(kSecond_ns, disturbed_until_ns_ - kSecond_ns), [this] { restart_server(); });
  if (chance(0.3)) {
    for (int i = 0; i < 3; ++i) {
      const std::int64_t at_ns = moment(0, disturbed_until_ns_), until_ns = at_ns + moment(50 * kMs, 700 * kMs);
      timeline_.at(at_ns, [this, until_ns] {
        journal_.count("tick stalled");
        host_->stall_tick(until_ns);
      });
    }
  }
  const bool has_hoarders = std::ranges::find(misbehaviours_, Misbehaviour::hoarder) != misbehaviours_.end();
  if (has_hoarders || chance(0.4)) {
    // Each reading of the clock lasts 10 us to 2 ms, so that a tick seems to take most of its time or more, and the
    // server must lower levels. Hoarders show whether it does so fairly, so it begins early where there are some.
    const std::int64_t reading_ns = moment(10'000, 2 * kMs);
    timeline_.at(moment(0, disturbed_until_ns_ / (has_hoarders ? 4 : 1)), [this, reading_ns] {
      journal_.count("work takes longer");
      host_->set_work(reading_ns);
    });
    timeline_.at(disturbed_until_ns_, [this] { host_->set_work(0); });
  }
  timeline_.run(disturbed_until_ns_ + kSecond_ns / 2);
}

// One line about a part that has not recovered yet; empty when everything has.
std::string Scenario::unsettled() {
  if (!host_->is_up()) return "the server is down";
  std::size_t character_count = 0;
  for (const auto& player : players_) character_count += player->keys().size();
  if (host_->server()->scheduler().rooms().characters().size() != character_count)
    return "the server has characters of those who have left";
  // An upload delays the poses of its client.
  if (host_->server()->grooms().upload_bytes() > 0) return "a groom is being uploaded or built";
  return whole::unsettled(players_);
}

// Ends all disturbances, and waits until every player knows the state of its room. It is a fault when this takes too
// long.
void Scenario::calm() {
  report("calm");
  for (const auto& bad_client : bad_clients_) bad_client->stop();
  // Packets sent before, over lost connections, may contradict later ones.
  const auto has_all_arrived = [](const auto& client) { return client->has_all_arrived(); };
  const std::int64_t stopped_ns = timeline_.now_ns();
  while (!std::ranges::all_of(bad_clients_, has_all_arrived) || !std::ranges::all_of(players_, has_all_arrived)) {
    timeline_.run(timeline_.now_ns() + 50 * kMs);
    if (timeline_.now_ns() - stopped_ns > kSettle_ns_max) return journal_.fault("all", "have sent what never arrives");
  }
  for (const auto& player : players_) player->calm_down();
  const std::int64_t begun_ns = timeline_.now_ns();
  double backlog_s_max = 0;
  for (const auto& player : players_) backlog_s_max = std::max(backlog_s_max, backlog_s(*player));
  const auto backlog_ns_max = static_cast<std::int64_t>(1e9 * backlog_s_max);
  // Everything must stay recovered for as long as the longest backlog: packets of before may still arrive during that
  // time.
  std::int64_t well_since_ns = begun_ns;
  std::string error = "nothing was looked at";
  do {
    timeline_.run(timeline_.now_ns() + 50 * kMs);
    error = unsettled();
    if (!error.empty()) well_since_ns = timeline_.now_ns();
  } while (well_since_ns < begun_ns + kSettle_ns_max + backlog_ns_max &&
           timeline_.now_ns() - well_since_ns < backlog_ns_max);
  if (!error.empty())
    journal_.fault("all", "are not well " + std::to_string((timeline_.now_ns() - begun_ns) / kSecond_ns) +
                              " s after the last disturbance: " + error);
  report("settled after " + std::to_string((timeline_.now_ns() - begun_ns) / kMs) + " ms");
}

// The time that packets to a player wait behind level records and full buffers, on a slow connection.
double Scenario::backlog_s(const Player& player) {
  const NetworkQuality& quality = player.plan().quality;
  // All that may lie between the server and the player's reading, over the least rate of the line.
  return static_cast<double>(quality.window_bytes + quality.unsent_bytes_max + kBases_bytes) /
         quality.min_bytes_per_s();
}

std::int64_t Scenario::owner_heard_ns(const Player::Member& member) const {
  const auto owner =
      std::ranges::find(players_, server::session_of(member.key), [](const auto& p) { return p->session(); });
  return owner == players_.end() ? timeline_.now_ns() : (*owner)->heard_ns();
}

// Everything has recovered and all heads move, so every client must get frames of every character in its room.
void Scenario::check_motion() {
  const std::int64_t begun_ns = timeline_.now_ns();
  timeline_.run(begun_ns + kMotion_ns);
  if (std::string error = unsettled(); !error.empty()) journal_.fault("all", "are no longer well: " + error);
  for (const auto& player : players_) {
    const double tick_s = 1.0 / config_.tick_rate_hz;
    for (const auto& [number, member] : player->members()) {
      // Nobody's hair moves without new poses.
      const auto silent_s = 1e-9 * static_cast<double>(owner_heard_ns(member) - member.last_ns);
      // A server may send a frame at every fourth tick only. Two of these, half a second for the line and the time of
      // its backlog are what a frame may take.
      if (silent_s > 8 * tick_s + 0.5 + backlog_s(*player))
        journal_.fault(player->name(), "has had no frame of member " + std::to_string(number) + " for " +
                                           std::to_string(silent_s) + " s, which moves");
    }
  }
}

bool Scenario::all_rest() {
  for (const auto& player : players_) {
    for (const auto& [number, member] : player->members()) {
      if (!member.asleep) return false;
    }
  }
  return true;
}

// The heads stop. All hair must then come to rest, and each client must learn this.
void Scenario::check_rest() {
  for (const auto& player : players_) player->set_moving(false);
  const std::int64_t begun_ns = timeline_.now_ns();
  // A client with a poor line may be sent away as slow, and bring its characters again.
  const auto until_ns = [&] {
    std::int64_t last_ns = begun_ns;
    for (const auto& player : players_) last_ns = std::max(last_ns, player->welcomed_ns());
    return std::min(last_ns, begun_ns + 2 * kRest_ns_max) + kRest_ns_max;
  };
  while (timeline_.now_ns() < until_ns() && !all_rest()) timeline_.run(timeline_.now_ns() + 100 * kMs);
  for (const auto& player : players_) {
    for (const auto& [number, member] : player->members()) {
      if (!member.asleep)
        journal_.fault(player->name(), "sees member " + std::to_string(number) + " not come to rest, on level " +
                                           std::string(kLevelNames[static_cast<std::size_t>(member.level)]));
    }
  }
  report("at rest after " + std::to_string((timeline_.now_ns() - begun_ns) / kMs) + " ms");
}

// All players leave, some without a goodbye. Then every time-out passes after which the server may still hold
// something of them.
void Scenario::leave() {
  report("all leave");
  for (const auto& player : players_) {
    timeline_.after(moment(0, 500 * kMs), [this, &player] { player->leave(chance(0.5)); });
  }
  const server::SessionLimits& limits = config_.sessions;
  timeline_.run(timeline_.now_ns() + kSecond_ns + std::max(limits.idle_timeout_ns, channel::kSilence_ns) +
                limits.drain_timeout_ns + limits.resume_grace_ns + config_.room_grace_ns + 2 * kSecond_ns);
}

Outcome Scenario::run() {
  seed_secrets(seed_);
  disturbed_until_ns_ = moment(2 * kSecond_ns, 6 * kSecond_ns);
  config_ = make_config();
  choose_misbehaviours();
  forget_levels();
  host_ = std::make_unique<ServerHost>(timeline_, journal_, config_, seed_);
  host_->start();
  make_players();
  make_bad_clients();
  disturb();
  calm();
  check_motion();
  check_rest();
  leave();
  host_->check_empty();
  host_->check_counts(host_->life());
  host_->count_life(host_->life());
  for (const auto& player : players_) player->finish();
  const std::uint64_t received = journal_.events("frames received") - journal_.events("frames overtaken");
  if (received > journal_.events("server: frames_sent")) journal_.fault("all", "received more frames than were sent");
  return {journal_.faults(), journal_.events(), journal_.hash(), 1e-9 * static_cast<double>(timeline_.now_ns())};
}

}  // namespace

Outcome run_scenario(std::uint64_t seed, bool is_verbose) {
  assets();
  return Scenario(seed, is_verbose).run();
}

}  // namespace hairnet::whole
