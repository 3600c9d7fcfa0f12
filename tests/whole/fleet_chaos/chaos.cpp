#include "tests/whole/fleet_chaos/chaos.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "schema/channel/monotonic_clock.hpp"

namespace hairnet::whole {
namespace {

// A session counts as having frames when the last one is newer than kFresh_ns.
constexpr std::int64_t kSecond_ns = 1'000'000'000, kFresh_ns = 500'000'000;
// This program looks at its sockets at least every 4 ms, so it sees a gap of frames precisely enough.
constexpr int kPumpWait_ms = 4;
// After an action all clients must have frames again within a minute, and keep them for kCalm_s, so that a short return
// between two losses does not count. kSettle_s is the time for the start.
constexpr double kSettle_s = 60, kCalm_s = 1.5;
constexpr std::size_t kFaultsMax = 200;

double seconds(std::int64_t ns) {
  return 1e-9 * static_cast<double>(ns);
}
std::int64_t to_ns(double s) {
  return std::llround(1e9 * s);
}

}  // namespace

bool Chaos::start(std::string& error) {
  without_etcd_ = options_.without_etcd == "both" ? "stop" : options_.without_etcd;
  Result<std::unique_ptr<ChaosFleet>> fleet =
      ChaosFleet::start(options_.folder, options_.lease_s, without_etcd_, owners_);
  if (!fleet) {
    error = fleet.error();
    return false;
  }
  fleet_ = std::move(*fleet);
  // The third client of each room is a visitor; every eighth client watches.
  for (std::size_t room = 0; room < options_.room_count; ++room) rooms_.push_back(fmt::format("room-{}", room));
  for (std::size_t n = 0; n < options_.client_count; ++n)
    add_client(rooms_[n % rooms_.size()], n % 8 == 7, n / rooms_.size() == 2);
  return true;
}

void Chaos::add_client(const std::string& room, bool is_watcher, bool is_visitor) {
  FleetClientDef def;
  def.number = clients_.size();
  def.room = room;
  def.is_watcher = is_watcher;
  def.is_visitor = is_visitor;
  for (std::size_t n = 0; n < kServerCount; ++n) def.servers.push_back(fleet_->address(n));
  def.port = kServerPort;
  def.own_address = Machines::client_address(def.number);
  def.seed = options_.seed;
  FleetClientEvents& events = *this;
  clients_.push_back(std::make_unique<FleetClient>(std::move(def), events));
  is_lost_.push_back(false);
}

double Chaos::now_s() const {
  return seconds(channel::monotonic_ns() - begin_ns_);
}

void Chaos::fault(const std::string& what) {
  if (faults_.size() < kFaultsMax) faults_.push_back(fmt::format("{:8.3f} s: {}", now_s(), what));
  fmt::print("FAULT seed {} at {:.3f} s: {}\n", options_.seed, now_s(), what);
  std::fflush(stdout);
}

void Chaos::on_lost(std::size_t client, std::size_t server, const std::string& error, std::int64_t) {
  // An attempt to come back may fail; the loss itself was noted before.
  if (is_lost_[client]) return;
  is_lost_[client] = true;
  // A session may get lost only where its own server is killed, drained, paused or cut off.
  const bool is_explained = action_ && is_of_server(action_->kind) && action_->target == server;
  if (action_) ++rows_[static_cast<std::size_t>(action_->kind)].sessions_lost;
  if (!is_explained)
    fault(fmt::format("client {} in {} lost server {} without a reason in what is done ({}): {}", client,
                      clients_[client]->def().room, server, action_ ? action_->what : "nothing", error));
}

void Chaos::on_ended(std::size_t client, const std::string& error, std::int64_t) {
  fault(fmt::format("client {} in {} ended for good: {}", client, clients_[client]->def().room, error));
}

void Chaos::pump() {
  std::vector<pollfd> sockets;
  std::vector<FleetClient*> of;
  for (const auto& client : clients_) {
    if (client->socket() < 0) continue;
    sockets.push_back({client->socket(), client->wanted(), 0});
    of.push_back(client.get());
  }
  ::poll(sockets.data(), sockets.size(), kPumpWait_ms);
  std::int64_t now_ns = channel::monotonic_ns();
  // The longest time in which this program did not read. A gap of that length may be its own.
  if (turned_ns_ > 0) lag_ns_max_ = std::max(lag_ns_max_, now_ns - turned_ns_);
  for (std::size_t i = 0; i < sockets.size(); ++i)
    if (sockets[i].revents != 0) of[i]->on_ready(sockets[i].revents, channel::monotonic_ns());
  for (const auto& client : clients_) client->poll(channel::monotonic_ns());
  check_owners(channel::monotonic_ns() - kLogLate_ns);
  turned_ns_ = now_ns = channel::monotonic_ns();
  if (now_ns - announced_ns_ >= kSecond_ns) print_progress(now_ns);
}

void Chaos::check_owners(std::int64_t until_ns) {
  fleet_->read_logs();
  for (; !received_.empty() && received_.front().arrival_ns <= until_ns; received_.pop_front()) {
    const Received& each = received_.front();
    owners_.received(each.client, each.server_process, each.room, each.stamp_ns, each.arrival_ns);
  }
  for (const std::string& what : owners_.take_faults()) fault(what);
}

void Chaos::pump_for(double length_s) {
  const std::int64_t until_ns = channel::monotonic_ns() + to_ns(length_s);
  while (channel::monotonic_ns() < until_ns) pump();
}

void Chaos::print_progress(std::int64_t now_ns) {
  const auto fresh = std::ranges::count_if(
      clients_, [&](const auto& c) { return !c->is_away() && now_ns - c->last_frame_ns() < kFresh_ns; });
  const auto here = std::ranges::count_if(clients_, [](const auto& c) { return !c->is_away(); });
  const auto owned = std::ranges::count_if(rooms_, [&](const std::string& room) {
    const auto owner = owners_.owner(room);
    return owner && now_ns - owner->last_ns < kLogLate_ns + kFresh_ns;
  });
  fmt::print("{:7.1f} s  {}/{} rooms, {}/{} sessions with frames, {:.0f} packets/s, faults {}  {}\n", now_s(), owned,
             rooms_.size(), fresh, here,
             static_cast<double>(owners_.packets - packets_announced_) / seconds(now_ns - announced_ns_),
             faults_.size(), action_ ? action_->what : "");
  std::fflush(stdout);
  announced_ns_ = now_ns;
  packets_announced_ = owners_.packets;
}

std::string Chaos::why_not_settled(std::int64_t now_ns) const {
  if (fleet_->etcd_healthy_since_ns() == 0) return "etcd does not answer";
  for (std::size_t n = 0; n < kServerCount; ++n)
    if (!fleet_->server(n).running()) return fmt::format("server {} does not run", n);
  for (const auto& client : clients_)
    if (!client->def().is_visitor && (!client->is_active() || now_ns - client->last_frame_ns() > kFresh_ns))
      return fmt::format("client {} in {}, at server {}, {}", client->def().number, client->def().room,
                         client->server(), client->is_active() ? "gets no frames" : "is not connected");
  return {};
}

// Waits until all has been well for kCalm_s.
void Chaos::settle(double seconds_max) {
  const std::int64_t begin_ns = channel::monotonic_ns();
  std::int64_t well_since_ns = 0;
  while (true) {
    pump();
    const std::int64_t now_ns = channel::monotonic_ns();
    const std::string error = why_not_settled(now_ns);
    if (!error.empty()) {
      well_since_ns = 0;
    } else if (well_since_ns == 0) {
      well_since_ns = now_ns;
    }
    if (well_since_ns != 0 && now_ns - well_since_ns > to_ns(kCalm_s)) return;
    if (now_ns - begin_ns > to_ns(seconds_max))
      return fault("not all is well again: " + (error.empty() ? "not for long" : error));
  }
}

bool Chaos::run() {
  begin_ns_ = announced_ns_ = channel::monotonic_ns();
  settle(kSettle_s);
  const std::int64_t end_ns = begin_ns_ + to_ns(options_.duration_s);
  bool is_switched = options_.without_etcd != "both";
  while (channel::monotonic_ns() < end_ns) {
    if (!is_switched && channel::monotonic_ns() - begin_ns_ > to_ns(options_.duration_s / 2)) {
      is_switched = true;
      switch_policy();
    }
    act(next_action());
  }
  end();
  print_report();
  return faults_.empty();
}

void Chaos::switch_policy() {
  without_etcd_ = "go_on";
  deck_.clear();
  fleet_->set_without_etcd(without_etcd_);
  for (std::size_t n = 0; n < kServerCount; ++n) act({.kind = ActionKind::drain_server, .target = n});
}

void Chaos::end() {
  action_.reset();
  for (const auto& client : clients_) client->leave(channel::monotonic_ns());
  const std::int64_t until_ns = channel::monotonic_ns() + kSecond_ns;
  while (channel::monotonic_ns() < until_ns && !std::ranges::all_of(clients_, &FleetClient::is_away)) {
    std::vector<pollfd> sockets;
    for (const auto& client : clients_) {
      if (client->is_away()) continue;
      pollfd its{client->socket(), client->wanted(), 0};
      if (client->socket() >= 0 && ::poll(&its, 1, 1) > 0) client->on_ready(its.revents, channel::monotonic_ns());
      if (!client->is_away()) client->poll(channel::monotonic_ns());
    }
  }
  for (const std::string& what : fleet_->stop()) fault(what);
  check_owners(channel::monotonic_ns());
}

void Chaos::print_report() const {
  fmt::print("\n{:<11} {:>5} {:>5} | {:^23} | {:^23} | {:^23}\n", "", "", "", "new owner of its rooms,",
             "longest gap of", "frames again after");
  fmt::print("{:<11} {:>5} {:>5} | {:^23} | {:^23} | {:^23}\n", "", "", "sess.", "s after the beginning",
             "its sessions, s", "the healing, s");
  fmt::print("{:<11} {:>5} {:>5} |{:>8}{:>8}{:>8} |{:>8}{:>8}{:>8} |{:>8}{:>8}{:>8}\n", "action", "times", "moved",
             "p50", "p99", "max", "p50", "p99", "max", "p50", "p99", "max");
  for (std::size_t kind = 0; kind < rows_.size(); ++kind) {
    const Row& row = rows_[kind];
    if (row.count == 0) continue;
    fmt::print("{:<11} {:>5} {:>5} | {} | {} | {}\n", kActionNames[kind], row.count, row.sessions_lost,
               row.owners.text(), row.gaps.text(), row.back.text());
  }
  const Times& drained = rows_[static_cast<std::size_t>(ActionKind::drain_server)].gaps;
  fmt::print("drained moves with a gap above 0.1 s: {} of {}\n", drained.count_above(to_ns(0.1)), drained.count());
  fmt::print("new rooms claimed after etcd's return, s: {} ({} rooms)\n", claims_after_outage_.text(),
             claims_after_outage_.count());
  std::uint64_t reconnects = 0;
  for (const auto& client : clients_) reconnects += client->reconnect_count();
  fmt::print("{} packets with frames, {} owners of rooms after each other, {} reconnects\n", owners_.packets,
             owners_.owners, reconnects);
  if (owners_.overlap_ns_max > 0) fmt::print("longest time of two owners: {:.3f} s\n", seconds(owners_.overlap_ns_max));
  fmt::print("in flight when the next owner began: {} packets, the last one arrived {:.3f} s later\n",
             owners_.in_flight, seconds(owners_.in_flight_ns_max));
  fmt::print("servers' logs:");
  for (const auto& [event, count] : fleet_->events())
    if (event.starts_with("lease_") || event.starts_with("room_") || event.starts_with("etcd_"))
      fmt::print(" {} {}", event, count);
  double load[1] = {};
  ::getloadavg(load, 1);
  fmt::print("\nlongest turn of this program: {:.3f} s; load of the machine in the last minute: {:.1f}\n",
             seconds(lag_ns_max_), load[0]);
  fmt::print("seed {}: {:.0f} s, {} faults\n", options_.seed, now_s(), faults_.size());
  for (const std::string& what : faults_) fmt::print("  {}\n", what);
  std::fflush(stdout);
}

}  // namespace hairnet::whole
