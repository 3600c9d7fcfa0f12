#include "tests/whole/directory_scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "server/fleet/choose_server.hpp"
#include "server/fleet/etcd_directory.hpp"
#include "server/fleet/fleet_values.hpp"
#include "tests/whole/etcd_line.hpp"

namespace hairnet::whole {
namespace {

using server::FleetEvent;
using server::Placement;

// Servers poll their directory at this interval, like ServerHost.
constexpr std::int64_t kPoll_ns = 20 * kMs;
// Faults begin and end within this time. Then everything must recover.
constexpr std::int64_t kFaults_ns = 90 * kSecond_ns;
// Within this time clients have asked for their room again, and etcd has removed the keys of an ended lease, which it
// does up to a second late (expiry_lag_s_max).
constexpr std::int64_t kAsked_ns = 3 * kSecond_ns;

// A server with only a directory, and a clock of its own.
class FleetHost {
 public:
  FleetHost(Timeline& timeline, EtcdLine& line, const server::EtcdDirectoryDef& def, double clock_rate,
            std::uint64_t seed)
      : timeline_(&timeline),
        clock_rate_(clock_rate),
        line_end_(
            line, [this] { return own_ns(); }, seed) {
    clock_offset_ns_ = static_cast<std::int64_t>(Random(seed).unit() * 1e15);
    directory_.emplace(def, line_end_, counters_);
    line_end_.set_sink(&*directory_);
  }

  void poll() {
    if (!is_paused_) directory_->poll(own_ns());
  }
  void pause() {
    is_paused_ = true;
    ++pauses_;
    line_end_.pause();
  }
  void resume() {
    is_paused_ = false;
    line_end_.resume();
  }
  [[nodiscard]] std::int64_t own_ns() const {
    return clock_offset_ns_ + static_cast<std::int64_t>(static_cast<double>(timeline_->now_ns()) * clock_rate_);
  }
  [[nodiscard]] server::EtcdDirectory& directory() { return *directory_; }
  [[nodiscard]] std::uint64_t server_id() const { return directory_->server_id(); }
  [[nodiscard]] EtcdLineEnd& line_end() { return line_end_; }
  [[nodiscard]] const server::FleetCounters& counters() const { return counters_; }
  [[nodiscard]] bool is_paused() const { return is_paused_; }
  // The true time since which the server could own a room: it runs and its line to etcd is good. It is empty when the
  // server could not.
  std::optional<std::int64_t> able_ns;
  // Returns how often the server was paused.
  [[nodiscard]] int pauses() const { return pauses_; }

 private:
  Timeline* timeline_;
  double clock_rate_;
  std::int64_t clock_offset_ns_ = 0;
  EtcdLineEnd line_end_;
  server::FleetCounters counters_;
  std::optional<server::EtcdDirectory> directory_;
  bool is_paused_ = false;
  int pauses_ = 0;
};

class DirectoryTrial {
 public:
  // Leases have 5 to 12 s. There are 2 to 5 servers, 1 to 12 rooms and 1 to 3 members of etcd. Clocks are up to 1 % too
  // fast or too slow.
  DirectoryTrial(std::uint64_t seed, bool is_verbose)
      : seed_(seed),
        is_verbose_(is_verbose),
        random_(seed, 77),
        // In every fourth seed rooms go on without etcd, and in every third one servers are eager; 77 keeps the random
        // numbers apart from those of the other trials with this seed.
        goes_on_(seed % 4 == 0),
        is_eager_(seed % 3 == 1),
        line_(timeline_, seed) {
    lease_s_ = 5 + static_cast<std::int64_t>(random_.unit() * 8);
    server_count_ = 2 + static_cast<std::size_t>(random_.unit() * 4);
    room_count_ = 1 + static_cast<std::size_t>(random_.unit() * 12);
    endpoint_count_ = 1 + static_cast<std::size_t>(random_.unit() * 3);
    line_.loss = random_.unit() < 0.5 ? 0 : random_.unit() * (goes_on_ ? 0.03 : 0.2);
    line_.clock_rate = 1 + 0.01 * random_.symmetric();
    line_.etcd.expiry_lag_s_max = random_.unit() < 0.5 ? 0 : 1;
    line_.is_silent = random_.unit() < 0.5;
    // For a server an answer that is later than the margin of its fence (lease_margin_ns) is like a partition. So where
    // rooms go on without etcd, answers are late by 0.3 s at most.
    line_.slow_ns = static_cast<std::int64_t>(random_.between(0.05, goes_on_ ? 0.3 : 3) * 1e9);
  }

  Outcome run() {
    for (std::size_t i = 0; i < server_count_; ++i) start_server(i);
    for (std::size_t i = 0; i < room_count_; ++i) {
      names_.push_back(fmt::format("room-{}", i));
      wanted_.push_back(true);
      releases_.push_back(0);
      ask_soon(i);
    }
    line_.keep_time();
    plan_faults();
    run_until(kFaults_ns);
    heal();
    settle();
    leave();
    outcome_.simulated_s = static_cast<double>(timeline_.now_ns()) * 1e-9;
    outcome_.hash = hash_;
    return std::move(outcome_);
  }

 private:
  // A room that was owned when etcd went down, and must keep its owner. It need not once the room was released or the
  // server was paused or killed, which the other members tell.
  struct Running {
    std::size_t room = 0;
    int releases = 0, pauses = 0;
    std::uint64_t server_id = 0;
  };
  // The owner of a room and the number of its claim.
  struct Held {
    std::uint64_t server_id = 0;
    std::int64_t claim = 0;
  };

  const std::string& room_name(std::size_t room) const { return names_[room]; }
  void count(const std::string& event, std::uint64_t n = 1) { outcome_.events[event] += n; }
  void tell(const std::string& what) {
    if (is_verbose_) fmt::print(stderr, "{:9.3f} {}\n", static_cast<double>(timeline_.now_ns()) * 1e-9, what);
  }
  void fault(const std::string& what) {
    if (outcome_.faults.size() < 20)
      outcome_.faults.push_back(
          fmt::format("seed {} at {:.3f} s: {}", seed_, static_cast<double>(timeline_.now_ns()) * 1e-9, what));
    tell("FAULT " + what);
  }
  template <class Action>
  void at(std::int64_t time_ns, Action action) {
    timeline_.at(time_ns, [this, action] { action(); });
  }
  void run_until(std::int64_t time_ns) {
    timeline_.run(time_ns, [this] {
      note_able();
      check_owners();
      return false;
    });
  }

  void start_server(std::size_t index) {
    server::EtcdDirectoryDef def;
    // An ID must not be 0, which means no server.
    def.server_id = random_.next() | 1;
    def.address = {.host = fmt::format("server-{}", index), .port = 7420, .page = ""};
    def.fleet = "test";
    def.endpoint_count = endpoint_count_;
    def.lease_s = lease_s_;
    def.without_etcd = goes_on_ ? server::WithoutEtcd::go_on : server::WithoutEtcd::stop;
    def.seed = random_.next();
    if (hosts_.size() <= index) hosts_.resize(index + 1);
    hosts_[index] = std::make_unique<FleetHost>(timeline_, line_, def, 1 + 0.01 * random_.symmetric(), random_.next());
    hosts_[index]->directory().tell({.free_share = random_.unit(), .free_characters = 100});
    tell(fmt::format("server {} starts as {:016x}", index, def.server_id));
    poll_soon(index, hosts_[index].get());
  }

  void poll_soon(std::size_t index, FleetHost* host) {
    at(timeline_.now_ns() + kPoll_ns, [this, index, host] {
      // The server may have been killed meanwhile, and another one may run in its place.
      if (hosts_[index].get() != host) return;
      host->poll();
      if (is_eager_ && !host->is_paused()) {
        const auto room = static_cast<std::size_t>(random_.unit() * static_cast<double>(room_count_));
        if (wanted_[room]) host->directory().claim(room_name(room), host->own_ns());
      }
      for (const FleetEvent& event : host->directory().take_events()) take_event(index, event);
      poll_soon(index, host);
    });
  }

  void take_event(std::size_t index, const FleetEvent& event) {
    static constexpr const char* kNames[] = {"room claimed",  "claim failed",     "room lost",       "lease paused",
                                             "lease resumed", "room handed over", "grooms passed on"};
    const char* name = kNames[static_cast<std::size_t>(event.kind)];
    count(name);
    // FNV-1a's factor. Two runs of a seed must give the same hash, or the seed would not repeat what it has found.
    hash_ = hash_ * 1099511628211u + static_cast<std::uint64_t>(event.claim) + static_cast<std::uint64_t>(event.kind) +
            static_cast<std::uint64_t>(timeline_.now_ns());
    tell(fmt::format("server {} {} {} {} {}", index, name, event.room, event.claim, event.reason));
  }

  // Lets a client of the room ask a server, and go where that server sends it.
  void ask_soon(std::size_t room) {
    at(timeline_.now_ns() + static_cast<std::int64_t>(random_.between(0.1, 0.4) * 1e9), [this, room] {
      if (wanted_[room]) ask(room, static_cast<std::size_t>(random_.unit() * static_cast<double>(hosts_.size())));
      ask_soon(room);
    });
  }
  void ask(std::size_t room, std::size_t first) {
    FleetHost* host = hosts_[first].get();
    const std::string& name = room_name(room);
    // A client follows three servers at most, and then asks again later.
    for (int hops = 0; host && !host->is_paused() && hops < 3; ++hops) {
      server::EtcdDirectory& directory = host->directory();
      const Placement placement = directory.where(name, host->own_ns());
      if (placement.kind == Placement::Kind::elsewhere) {
        host = find(placement.server_id);
        continue;
      }
      if (placement.kind != Placement::Kind::unowned) return;
      const auto chosen = server::choose_server(name, directory.servers());
      FleetHost* owner = chosen ? find(*chosen) : host;
      if (owner && !owner->is_paused()) owner->directory().claim(name, owner->own_ns());
      return;
    }
  }
  FleetHost* find(std::uint64_t id) {
    for (const auto& host : hosts_)
      if (host && host->directory().server_id() == id) return host.get();
    return nullptr;
  }

  void note_able() {
    // A line that loses or damages messages is never good for long.
    const bool is_etcd_good =
        !line_.etcd.is_down() && line_.dead_members.size() < endpoint_count_ && line_.loss == 0 && line_.damaged == 0;
    first_able_ns_.reset();
    for (const auto& host : hosts_) {
      if (!host) continue;
      if (!is_etcd_good || host->is_paused() || !host->line_end().is_good())
        host->able_ns.reset();
      else if (!host->able_ns)
        host->able_ns = timeline_.now_ns();
      if (host->able_ns) first_able_ns_ = std::min(first_able_ns_.value_or(*host->able_ns), *host->able_ns);
    }
  }

  // The promise: a room that is asked for has an owner, which may step it, within two leases and kAsked_ns, as long as
  // some server is able to own rooms. The time counts from the last fault that stops servers, because it may have hit
  // the server that was about to own the room.
  void check_stands_still(std::size_t room, bool is_held) {
    std::int64_t& moved_ns = moved_ns_[room];
    if (is_held || !wanted_[room] || !first_able_ns_) moved_ns = timeline_.now_ns();
    const std::int64_t since_ns = std::max({moved_ns, last_fault_ns_, first_able_ns_.value_or(0)});
    if (timeline_.now_ns() - since_ns <= 2 * lease_s_ * kSecond_ns + kAsked_ns) return;
    fault(fmt::format("{} has stood still since {:.3f} s", room_name(room), static_cast<double>(since_ns) * 1e-9));
    moved_ns = timeline_.now_ns();
  }

  // The promise: no two servers may send frames of one room, by their own clocks, at one true time.
  void check_owners() {
    for (std::size_t room = 0; room < room_count_; ++room) {
      const std::string& name = room_name(room);
      std::optional<Held> holder;
      for (const auto& host : hosts_) {
        if (!host || !host->directory().holds(name, host->own_ns())) continue;
        const Held held{host->directory().server_id(), host->directory().where(name, host->own_ns()).claim};
        if (holder) fault(fmt::format("{} has two owners, {:x} and {:x}", name, holder->server_id, held.server_id));
        holder = held;
      }
      check_stands_still(room, holder.has_value());
      if (!holder) continue;
      Held& last = last_[room];
      if (holder->server_id != last.server_id && holder->claim <= last.claim)
        fault(fmt::format("{}: the new owner's claim {} is not newer than {}", name, holder->claim, last.claim));
      if (holder->server_id != last.server_id) count("owners");
      last = *holder;
    }
  }

  void plan_faults() {
    const int count_of = 3 + static_cast<int>(random_.unit() * 12);
    for (int i = 0; i < count_of; ++i) {
      const auto begin_ns = static_cast<std::int64_t>(random_.between(3, 75) * 1e9);
      // A failure lasts 0.3 to 25 s. Its logarithm is uniform, so short and long ones are equally common.
      const auto length_ns = static_cast<std::int64_t>(std::exp(random_.between(std::log(0.3), std::log(25))) * 1e9);
      at(begin_ns, [this, length_ns] { begin_fault(std::min(timeline_.now_ns() + length_ns, kFaults_ns)); });
    }
  }

  void begin_fault(std::int64_t end_ns) {
    const auto index = static_cast<std::size_t>(random_.unit() * static_cast<double>(hosts_.size()));
    // Where rooms go on without etcd, only faults that all servers see alike are harmless: a server that is cut off
    // alone keeps its rooms while another one claims them. The other faults are replaced by an etcd that is down.
    const int kind = static_cast<int>(random_.unit() * 14);
    // Kinds below 7 stop servers or etcd, and so do late (11) and damaged (12) answers. After one of them rooms may
    // stand still for a while.
    if (kind < 7 || kind == 11 || kind == 12) last_fault_ns_ = timeline_.now_ns();
    // The other faults are a cut (0, 1), a pause with messages that get lost (2, 3), and kinds from 11 on.
    if (goes_on_ && (kind < 2 || (kind < 4 && line_.loss > 0) || kind >= 11)) return etcd_down(end_ns);
    switch (kind) {
      case 0:
      case 1:
        return cut(index, end_ns);
      case 2:
      case 3:
        return pause(index, end_ns);
      case 4:
        return kill(index, end_ns);
      case 5:
        return etcd_down(end_ns);
      case 6:
        return member_down(end_ns);
      case 7:
        count("compaction");
        if (!line_.etcd.is_down()) line_.etcd.compact();
        return;
      case 8:
      case 9:
        return bad_value(end_ns);
      case 10:
        count("repeated answers");
        line_.repeated = 0.3;
        return;
      case 11:
        return late(index, end_ns);
      case 12:
        count("damaged answers");
        line_.damaged = 0.1;
        return at(end_ns, [this] { line_.damaged = 0; });
      default:
        break;
    }
    // A room empties, and is wanted again later.
    const auto room = static_cast<std::size_t>(random_.unit() * static_cast<double>(room_count_));
    wanted_[room] = false;
    ++releases_[room];
    for (const auto& each : hosts_)
      if (each && !each->is_paused()) each->directory().release(room_name(room), each->own_ns());
    count("release");
    at(timeline_.now_ns() + static_cast<std::int64_t>(random_.unit() * 3e9), [this, room] { wanted_[room] = true; });
  }

  void cut(std::size_t index, std::int64_t end_ns) {
    FleetHost* host = hosts_[index].get();
    if (!host || !host->line_end().is_good()) return;
    static constexpr const char* kNames[] = {"", "cut", "requests lost", "answers lost"};
    const auto cut = static_cast<LineCut>(1 + random_.next() % 3);
    count(kNames[static_cast<std::size_t>(cut)]);
    tell(fmt::format("server {} is cut off: {}", index, kNames[static_cast<std::size_t>(cut)]));
    host->line_end().cut(cut);
    if (cut == LineCut::answers) end_ns = std::max(end_ns, long_end_ns());
    at(end_ns, [this, index, host] {
      if (hosts_[index].get() == host) host->line_end().cut(LineCut::none);
    });
  }
  // Ends a fault that must not keep rooms from others for long.
  std::int64_t long_end_ns() {
    const double leases = random_.between(2, 5);
    return std::min(timeline_.now_ns() + static_cast<std::int64_t>(leases * static_cast<double>(lease_s_) * 1e9),
                    kFaults_ns);
  }
  // Delays all answers of etcd to this server by a little more than a third of the lease, half of it, or all of it. A
  // keep-alive is due at each third.
  void late(std::size_t index, std::int64_t end_ns) {
    FleetHost* host = hosts_[index].get();
    if (!host || !host->line_end().is_good()) return;
    const double leases = (std::array{0.34, 0.55, 1.1})[random_.next() % 3];
    count("late answers");
    tell(fmt::format("server {} hears etcd {} leases later", index, leases));
    host->line_end().make_late(static_cast<std::int64_t>(leases * static_cast<double>(lease_s_ * kSecond_ns)));
    at(std::max(end_ns, long_end_ns()), [this, index, host] {
      if (hosts_[index].get() == host) host->line_end().make_late(0);
    });
  }
  void bad_value(std::int64_t end_ns) {
    if (line_.etcd.is_down()) return;
    count("bad value");
    const FleetHost* host = hosts_[random_.next() % hosts_.size()].get();
    const std::string id = host && random_.unit() < 0.5 ? server::id_text(host->server_id()) : "0000000000000001";
    const std::string key = random_.unit() < 0.5 ? "servers/" + id : "kept/" + room_name(random_.next() % room_count_);
    tell("a bad value: " + key);
    line_.put_bad_value("/hairnet/test/" + key, end_ns, random_);
  }
  void pause(std::size_t index, std::int64_t end_ns) {
    FleetHost* host = hosts_[index].get();
    if (!host || host->is_paused()) return;
    count("pause");
    tell(fmt::format("server {} is paused", index));
    host->pause();
    at(end_ns, [this, index, host] {
      if (hosts_[index].get() == host) host->resume();
    });
  }
  void kill(std::size_t index, std::int64_t end_ns) {
    if (!hosts_[index]) return;
    count("kill");
    tell(fmt::format("server {} is killed", index));
    hosts_[index].reset();
    at(end_ns, [this, index] {
      if (!hosts_[index]) start_server(index);
    });
  }
  void etcd_down(std::int64_t end_ns) {
    if (line_.etcd.is_down()) return;
    count("etcd down");
    tell("etcd is down");
    line_.etcd.go_down();
    for (const auto& host : hosts_)
      if (host) host->line_end().break_streams();
    // All rooms that have an owner now must keep it, where rooms go on without etcd.
    std::vector<Running> running;
    if (goes_on_)
      for (std::size_t room = 0; room < room_count_; ++room)
        for (const auto& host : hosts_)
          if (host && !host->is_paused() && host->directory().holds(room_name(room), host->own_ns()))
            running.push_back({room, releases_[room], host->pauses(), host->directory().server_id()});
    watch_running(std::move(running), end_ns);
    at(end_ns, [this] {
      tell("etcd is up");
      line_.come_up();
    });
  }
  // Checks once a second, while etcd is down, that each of these rooms still has its owner. Rooms that were released,
  // and those of servers that were paused or killed, are left out from then on.
  void watch_running(std::vector<Running> running, std::int64_t end_ns) {
    if (running.empty() || timeline_.now_ns() >= end_ns) return;
    std::erase_if(running, [this](const auto& one) {
      const auto& [room, releases, pauses, server_id] = one;
      FleetHost* host = find(server_id);
      if (!host || releases_[room] != releases || host->pauses() != pauses) return true;
      if (host->directory().holds(room_name(room), host->own_ns())) {
        count("went on");
        return false;
      }
      fault(fmt::format("{} did not go on without etcd", room_name(room)));
      return true;
    });
    at(timeline_.now_ns() + kSecond_ns,
       [this, running = std::move(running), end_ns] { watch_running(running, end_ns); });
  }
  void member_down(std::int64_t end_ns) {
    const auto member = static_cast<std::size_t>(random_.unit() * static_cast<double>(endpoint_count_));
    if (endpoint_count_ == 1 || !line_.dead_members.empty()) return;
    count("member down");
    line_.dead_members.insert(member);
    at(end_ns, [this, member] { line_.dead_members.erase(member); });
  }

  void heal() {
    tell("all faults have ended");
    is_eager_ = false;
    line_.loss = line_.slow = line_.damaged = line_.repeated = 0;
    // Lets everything happen that is due now.
    run_until(timeline_.now_ns() + 1);
  }

  // Waits until every room has one owner and all servers know it, for a lease and 30 s at most, and checks that it is
  // still so after 5 s more.
  void settle() {
    std::fill(wanted_.begin(), wanted_.end(), true);
    const std::int64_t begin_ns = timeline_.now_ns(), end_ns = begin_ns + (lease_s_ + 30) * kSecond_ns;
    while (timeline_.now_ns() < end_ns && !why_not_settled().empty()) run_until(timeline_.now_ns() + 100 * kMs);
    if (const std::string error = why_not_settled(); !error.empty()) fault("not settled: " + error);
    count("settled after ms", static_cast<std::uint64_t>((timeline_.now_ns() - begin_ns) / kMs));
    run_until(timeline_.now_ns() + 5 * kSecond_ns);
    if (const std::string error = why_not_settled(); !error.empty()) fault("settled no longer: " + error);
  }
  // Returns the first room without an owner, or the first server that does not know an owner; empty: all is well.
  std::string why_not_settled() {
    for (std::size_t room = 0; room < room_count_; ++room) {
      const std::string& name = room_name(room);
      std::uint64_t owner = 0;
      for (const auto& host : hosts_)
        if (host && host->directory().holds(name, host->own_ns())) owner = host->directory().server_id();
      if (owner == 0) return name + " has no owner";
      for (const auto& host : hosts_) {
        if (!host) continue;
        const Placement placement = host->directory().where(name, host->own_ns());
        if (placement.server_id != owner)
          return fmt::format("{:x} does not know the owner of {}", host->directory().server_id(), name);
      }
    }
    return {};
  }

  // Nobody wants a room any more. In the end nothing of the servers may be left in etcd, or the keys of dead rooms
  // would fill it.
  void leave() {
    std::fill(wanted_.begin(), wanted_.end(), false);
    for (std::size_t room = 0; room < room_count_; ++room)
      for (const auto& host : hosts_)
        if (host) host->directory().release(room_name(room), host->own_ns());
    run_until(timeline_.now_ns() + 5 * kSecond_ns);
    for (const std::string& key : line_.etcd.keys())
      if (key.find("/rooms/") != std::string::npos) fault("was not released: " + key);
    for (const auto& host : hosts_)
      if (host && host->directory().room_count() != 0) fault("a directory has rooms that nobody wants");
    for (const auto& host : hosts_)
      if (host) host->directory().stop(host->own_ns());
    run_until(timeline_.now_ns() + (lease_s_ + 3) * kSecond_ns);
    for (const auto& host : hosts_) {
      if (!host) continue;
      if (!host->directory().is_stopped()) fault("a directory has not stopped");
      const server::FleetCounters& counters = host->counters();
      count("leases lost", counters.leases_lost.value());
      count("outages bridged", counters.outages_bridged.value());
      count("claims lost", counters.claims_lost.value());
      count("lists", counters.lists.value());
      count("entries skipped", counters.entries_refused_malformed.value() + counters.entries_refused_oversize.value());
      count("answers malformed", counters.requests_failed_malformed.value());
      count("answers too long", counters.requests_failed_oversize.value());
    }
    // What servers store of a room, such as a ban, has a lease of its own, which outlives the servers by up to an hour.
    line_.etcd.advance(line_.now_ns() + 3700 * kSecond_ns);
    for (const std::string& key : line_.etcd.keys()) fault("was left: " + key);
    if (line_.etcd.lease_count() != 0) fault("a lease was left");
    if (line_.etcd.watch_count() != 0) fault("a watch was left");
  }

  std::uint64_t seed_;
  bool is_verbose_;
  Random random_;
  // `goes_on_`: rooms go on without etcd. `is_eager_`: servers claim random rooms at each poll, to win each at the
  // first possible moment.
  bool goes_on_, is_eager_;
  Timeline timeline_;
  EtcdLine line_;
  std::int64_t lease_s_ = 9;
  std::size_t server_count_ = 0, room_count_ = 0, endpoint_count_ = 1;
  // The servers by index; null while one is killed.
  std::vector<std::unique_ptr<FleetHost>> hosts_;
  // These lists are by the index of the room: the name, whether clients ask for it, and how often it was given back.
  std::vector<std::string> names_;
  std::vector<bool> wanted_;
  std::vector<int> releases_;
  // The last owner of each room.
  std::map<std::size_t, Held> last_;
  // The last time at which each room had an owner, was not asked for, or no server could own it.
  std::map<std::size_t, std::int64_t> moved_ns_;
  // The earliest of all able_ns; empty while no server could own a room.
  std::optional<std::int64_t> first_able_ns_;
  // The begin of the last fault that stops servers.
  std::int64_t last_fault_ns_ = 0;
  std::uint64_t hash_ = 14695981039346656037u;
  Outcome outcome_;
};

}  // namespace

Outcome run_directory_scenario(std::uint64_t seed, bool is_verbose) {
  return DirectoryTrial(seed, is_verbose).run();
}

}  // namespace hairnet::whole
