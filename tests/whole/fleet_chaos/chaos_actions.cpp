#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <cmath>

#include "schema/channel/monotonic_clock.hpp"
#include "tests/whole/fleet_chaos/chaos.hpp"

// This file has the actions that disturb the fleet, and the checks after each.
namespace hairnet::whole {
namespace {

// A drained server must end within kDrainWait_s. After each action all must have frames again within kBackWait_s.
constexpr double kDrainWait_s = 30, kBackWait_s = 60;
// So many clients ask for new rooms while etcd is down.
constexpr std::size_t kProbes = 4;

double from_ns(std::int64_t ns) {
  return 1e-9 * static_cast<double>(ns);
}

}  // namespace

// The actions come like cards of a shuffled deck: each kind once before any comes again.
Chaos::Action Chaos::next_action() {
  if (deck_.empty()) {
    std::vector<ActionKind> kinds;
    for (const std::string& name : options_.actions) {
      const auto kind = static_cast<ActionKind>(std::ranges::find(kActionNames, name) - kActionNames.begin());
      // Where rooms go on without etcd, a server that is cut off alone keeps its rooms while another one claims them.
      // So this action is left out, unless the command line asks for it alone, to show that two owners are seen.
      const bool is_harmless = kind != ActionKind::cut_server || without_etcd_ == "stop";
      if (is_harmless || options_.actions.size() == 1) kinds.push_back(kind);
    }
    for (std::size_t i = kinds.size(); i > 1; --i) std::swap(kinds[i - 1], kinds[random_.next() % i]);
    deck_.assign(kinds.begin(), kinds.end());
  }
  Action action{.kind = deck_.front()};
  deck_.pop_front();
  action.target = random_.next() % kEtcdCount;
  if (!is_of_server(action.kind)) return action;
  // Chooses the owner of some room, because a server without rooms has nothing to lose.
  const auto owner = owners_.owner(rooms_[random_.next() % rooms_.size()]);
  if (owner) action.target = fleet_->server_of(owner->server);
  return action;
}

void Chaos::act(Action action) {
  action.begin_ns = channel::monotonic_ns();
  const bool is_of_one_server = is_of_server(action.kind);
  for (const auto& client : clients_) {
    const bool is_its = !is_of_one_server || client->server() == action.target;
    if (is_its && client->is_active() && !client->def().is_visitor) action.clients.push_back(client->def().number);
    client->begin_watch(action.begin_ns);
  }
  for (const std::string& room : rooms_)
    if (const auto owner = owners_.owner(room);
        is_of_one_server && owner && fleet_->server_of(owner->server) == action.target)
      action.rooms.push_back(room);
  action.what = kActionNames[static_cast<std::size_t>(action.kind)];
  if (action.kind != ActionKind::etcd_down) action.what += fmt::format(" {}", action.target);
  action_ = action;
  make(action);
  if (action.healed_ns == 0) action.healed_ns = channel::monotonic_ns();
  settle(kBackWait_s);
  judge(action);
  pump_for(random_.between(0.5, 2));
}

void Chaos::make(Action& action) {
  const std::size_t n = action.target;
  // A pause or a cut lasts from less than the lease of 5 s to three times as long.
  const double length_s = random_.between(3, 15);
  const auto tell = [this](const std::string& more) {
    action_->what += more;
    fmt::print("{:7.1f} s  {}\n", now_s(), action_->what);
  };
  switch (action.kind) {
    case ActionKind::kill_server: {
      const double away_s = random_.between(0.2, 12);
      tell(fmt::format(", restarted after {:.1f} s", away_s));
      fleet_->server(n).send(SIGKILL);
      pump_for(away_s);
      fleet_->start_server(n);
      break;
    }
    case ActionKind::drain_server: {
      tell("");
      fleet_->server(n).send(SIGTERM);
      const std::int64_t until_ns = channel::monotonic_ns() + std::llround(kDrainWait_s * 1e9);
      while (fleet_->server(n).running() && channel::monotonic_ns() < until_ns) pump();
      if (const int code = fleet_->server(n).wait(0); code != 0)
        fault(fmt::format("server {} ended with {} after SIGTERM", n, code));
      pump_for(random_.between(0, 2));
      fleet_->start_server(n);
      break;
    }
    case ActionKind::pause_server:
      tell(fmt::format(" for {:.1f} s", length_s));
      fleet_->server(n).send(SIGSTOP);
      pump_for(length_s);
      fleet_->server(n).send(SIGCONT);
      break;
    case ActionKind::cut_server: {
      const auto direction = static_cast<CutDirection>(random_.next() % 3);
      tell(fmt::format(" off from etcd, {}, for {:.1f} s", to_string(direction), length_s));
      require(fleet_->cut_server(n, direction));
      pump_for(length_s);
      require(fleet_->heal_server(n));
      break;
    }
    case ActionKind::kill_etcd:
      tell(fmt::format(", restarted after {:.1f} s", length_s));
      fleet_->etcd(n).send(SIGKILL);
      pump_for(length_s);
      fleet_->start_etcd(n);
      break;
    case ActionKind::pause_etcd:
      tell(fmt::format(" for {:.1f} s", length_s));
      fleet_->etcd(n).send(SIGSTOP);
      pump_for(length_s);
      fleet_->etcd(n).send(SIGCONT);
      break;
    case ActionKind::cut_etcd:
      tell(fmt::format(" from the other etcds for {:.1f} s", length_s));
      require(fleet_->cut_etcd(n));
      pump_for(length_s);
      require(fleet_->heal_etcd(n));
      break;
    case ActionKind::etcd_down:
      tell(fmt::format(" for {:.1f} s, rooms {}", options_.outage_s, without_etcd_));
      make_etcd_down(action);
      break;
  }
}

// Kills all etcds and starts them again. Clients ask for new rooms meanwhile, which must get owners soon after the
// return of etcd.
void Chaos::make_etcd_down(Action& action) {
  for (std::size_t n = 0; n < kEtcdCount; ++n) fleet_->etcd(n).send(SIGKILL);
  pump_for(0.1 * options_.outage_s);
  const std::size_t first_probe = clients_.size();
  for (std::size_t i = 0; i < kProbes; ++i) add_client(fmt::format("new-room-{}", probe_count_++), false, false);
  pump_for(0.9 * options_.outage_s);
  const std::int64_t begin_ns = channel::monotonic_ns();
  for (std::size_t n = 0; n < kEtcdCount; ++n) fleet_->start_etcd(n);
  const std::int64_t until_ns = begin_ns + std::llround(kBackWait_s * 1e9);
  while (fleet_->etcd_healthy_since_ns() < begin_ns && channel::monotonic_ns() < until_ns) pump();
  action.healed_ns = fleet_->etcd_healthy_since_ns();
  if (action.healed_ns < begin_ns) return fault("etcd does not come back");
  const auto is_in = [](const auto& client) { return client->first_frame_ns() != 0; };
  while (!std::all_of(clients_.begin() + static_cast<std::ptrdiff_t>(first_probe), clients_.end(), is_in) &&
         channel::monotonic_ns() < until_ns)
    pump();
  pump_for(from_ns(kLogLate_ns));
  for (std::size_t i = first_probe; i < clients_.size(); ++i) {
    const std::string& room = clients_[i]->def().room;
    const auto claimed_ns = owners_.claimed_after(room, action.begin_ns);
    if (!claimed_ns || !is_in(clients_[i])) {
      fault(room + " got no owner after etcd's return");
      continue;
    }
    const std::int64_t wait_ns = std::max<std::int64_t>(*claimed_ns - action.healed_ns, 0);
    claims_after_outage_.add(wait_ns);
    if (from_ns(wait_ns) > options_.claim_limit_s)
      fault(fmt::format("{} got an owner only {:.1f} s after etcd's return", room, from_ns(wait_ns)));
  }
  for (std::size_t i = first_probe; i < clients_.size(); ++i) clients_[i]->leave(channel::monotonic_ns());
  pump_for(0.2);
  clients_.resize(first_probe);
  is_lost_.resize(first_probe);
}

void Chaos::judge(const Action& action) {
  const std::int64_t now_ns = channel::monotonic_ns();
  Row& row = rows_[static_cast<std::size_t>(action.kind)];
  ++row.count;
  for (const std::string& room : action.rooms) {
    const auto claimed_ns = owners_.claimed_after(room, action.begin_ns);
    if (claimed_ns) row.owners.add(*claimed_ns - action.begin_ns);
    if (action.kind != ActionKind::kill_server) continue;
    if (!claimed_ns || from_ns(*claimed_ns - action.begin_ns) > options_.owner_limit_s)
      fault(fmt::format("{} had no owner within {} s after its server was killed", room, options_.owner_limit_s));
  }
  // After these actions rooms must go on nearly without a gap: a drained server hands its rooms over, and etcd works
  // without one member.
  const bool must_go_on = action.kind == ActionKind::drain_server || action.kind == ActionKind::kill_etcd ||
                          action.kind == ActionKind::pause_etcd || action.kind == ActionKind::cut_etcd ||
                          (action.kind == ActionKind::etcd_down && without_etcd_ == "go_on");
  for (const std::size_t number : action.clients) {
    const FleetClient& client = *clients_[number];
    const std::int64_t gap_ns = client.gap_ns_max(now_ns);
    row.gaps.add(gap_ns);
    if (client.back_ns() > 0) row.back.add(std::max<std::int64_t>(client.back_ns() - action.healed_ns, 0));
    if (must_go_on && from_ns(gap_ns) > options_.gap_limit_s)
      fault(fmt::format("client {} in {} got no frames for {:.3f} s ({})", number, client.def().room, from_ns(gap_ns),
                        action_->what));
  }
}

}  // namespace hairnet::whole
