#include "tests/load/fleet_plan/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::fleet_plan {
namespace {

// The largest number of samples of a run. Samples are the points of the page's plots. With the default of two days a
// sample covers five minutes.
constexpr double kSampleIntervals = 576;
// The simulation looks for people who are there at the start among the arrivals of the day before. With the default
// lengths of sessions (mean 30 minutes, log-normal with sigma 1) less than one in 100 000 lasts longer than a day.
constexpr std::int64_t kPastSeconds = 86'400;

}  // namespace

Simulation::Simulation(const Settings& settings) : settings_(settings), demand_(settings), random_(settings.seed) {
  HAIRNET_ASSERT(validate(settings).empty());
  end_s_ = static_cast<std::int64_t>(std::llround(settings.days * 86'400));
  departures_.resize(static_cast<std::size_t>(end_s_) + 1);
  rooms_.resize(settings.rooms);
  for (std::uint32_t i = 0; i < settings.rooms; ++i) room_names_.push_back("room-" + std::to_string(i));
  interval_seconds_ = std::max<std::int64_t>(60, std::llround(settings.days * 86'400 / kSampleIntervals));
  until_arrival_ = exponential(random_);
  fill();
}

// Makes the people who came on the day before and are still there, and servers for them. The levels of their hairstyles
// are in memory already, and etcd's work for this is not counted.
void Simulation::fill() {
  for (std::int64_t second = -kPastSeconds; second < 0; ++second) {
    const double rate = demand_.arrivals_per_s(static_cast<double>(second + kPastSeconds));
    for (; until_arrival_ < rate; until_arrival_ += exponential(random_)) {
      const double ends_s = static_cast<double>(second) + demand_.session_s(random_);
      if (ends_s < 1) continue;
      const RoomId room = demand_.room(random_);
      if (settings_.room_cap != 0 && rooms_[room].members.size() >= settings_.room_cap) continue;
      const PersonId id = add_person(second);
      Person& person = people_[id];
      person.room = room;
      person.is_member = true;
      person.place = static_cast<std::uint32_t>(rooms_[room].members.size());
      rooms_[room].members.push_back(id);
      ++member_count_;
      const auto leaves_s = static_cast<std::size_t>(ends_s);
      if (leaves_s < departures_.size()) departures_[leaves_s].push_back(id);
    }
    until_arrival_ -= rate;
  }
  outcome_.at_start = member_count_;
  double cpu_s = 0;
  for (RoomId room = 0; room < rooms_.size(); ++room) {
    update_load(room);
    cpu_s += rooms_[room].cpu_s;
  }
  // target() computes the number of servers from cpu_s_; own() then adds each room to cpu_s_ again.
  cpu_s_ = cpu_s;
  const std::size_t servers = target();
  cpu_s_ = 0;
  for (std::size_t i = 0; i < servers; ++i) make_ready(start_server(0));
  for (RoomId room = 0; room < rooms_.size(); ++room) {
    if (rooms_[room].members.empty()) continue;
    if (!place(room)) {
      rooms_[room].state = Room::State::away;
      set_pending(room);
      continue;
    }
    Server& server = servers_[rooms_[room].owner];
    for (const PersonId id : rooms_[room].members) {
      double& at_s = server.hairstyle_at_s[people_[id].hairstyle];
      if (!std::isinf(at_s)) continue;
      at_s = 0;
      ++server.hairstyles;
    }
    tell_statuses();
  }
  second_ = {};
}

PersonId Simulation::add_person(std::int64_t since_s) {
  PersonId id = 0;
  if (free_people_.empty()) {
    id = static_cast<PersonId>(people_.size());
    people_.emplace_back();
  } else {
    id = free_people_.back();
    free_people_.pop_back();
  }
  people_[id] = {.hairstyle = static_cast<std::uint32_t>(random_.unit() * settings_.hairstyles), .since_s = since_s};
  return id;
}

// The order matters: people leave before others arrive, so that their places are free, and everything is counted last.
void Simulation::step() {
  HAIRNET_ASSERT(!is_done());
  take_starts_and_ends();
  // The number of servers is decided every 15 s, which is also the default of Kubernetes' HorizontalPodAutoscaler.
  if (now_s_ % 15 == 0) scale();
  deploy();
  take_departures();
  balance();
  take_pending();
  take_arrivals();
  release_empty();
  keep_alive();
  tell_statuses();
  account();
  ++now_s_;
}

void Simulation::take_arrivals() {
  const double rate = demand_.arrivals_per_s(static_cast<double>(now_s_));
  for (; until_arrival_ < rate; until_arrival_ += exponential(random_)) {
    ++outcome_.arrived;
    seek_room(add_person(now_s_));
  }
  until_arrival_ -= rate;
}

// A person who finds a room full asks for another one.
void Simulation::seek_room(PersonId id) {
  for (; people_[id].tries < settings_.room_tries; ++people_[id].tries) {
    const RoomId room = demand_.room(random_);
    const std::size_t there = rooms_[room].members.size() + rooms_[room].waiting.size();
    if (settings_.room_cap == 0 || there < settings_.room_cap) {
      people_[id].room = room;
      break;
    }
    ++outcome_.refused_by_caps;
  }
  const RoomId room_id = people_[id].room;
  if (room_id == kNone) {
    ++outcome_.turned_away_rooms_full;
    return remove_person(id);
  }
  Room& room = rooms_[room_id];
  double delay_s = 0;
  if (room.state == Room::State::unowned) {
    if (!place(room_id)) {
      // No server takes rooms now. The room tries again in the next second.
      if (room.state == Room::State::unowned) {
        room.state = Room::State::away;
        room.try_at_s = now_s_ + 1;
      }
      return wait_for(room_id, id);
    }
    delay_s = settings_.costs.claim_ms / 1e3;
  }
  if (room.state == Room::State::away || !room.waiting.empty() || is_full(servers_[room.owner]))
    return wait_for(room_id, id);
  admit(room_id, id, delay_s);
}

void Simulation::wait_for(RoomId room, PersonId id) {
  rooms_[room].waiting.push_back(id);
  ++waiting_count_;
  set_pending(room);
}

// Makes the person a member, since the room's server has a place. `delay_s` is what the person has waited in addition
// to the whole seconds since the arrival.
void Simulation::admit(RoomId room_id, PersonId id, double delay_s) {
  Room& room = rooms_[room_id];
  Person& person = people_[id];
  person.is_member = true;
  person.place = static_cast<std::uint32_t>(room.members.size());
  room.members.push_back(id);
  room.empty_since_s = -1;
  ++member_count_;
  update_load(room_id);
  ++servers_[room.owner].people;
  // The departures of this second are over, so a session ends in the next second at the earliest.
  const double stays_s = static_cast<double>(now_s_) + 1 + demand_.session_s(random_);
  if (stays_s < static_cast<double>(departures_.size())) departures_[static_cast<std::size_t>(stays_s)].push_back(id);
  delay_s += static_cast<double>(now_s_ - person.since_s) + connect_s(count(Server::State::ready)) +
             level_wait_s(servers_[room.owner], person.hairstyle);
  outcome_.join.record(std::llround(delay_s * 1e9));
}

// Returns the time to connect. A person asks a random server first: with a chance of 1 / `ready_servers` this is the
// owner, else the server redirects the person, who connects a second time.
double Simulation::connect_s(std::size_t ready_servers) {
  const double once_s = settings_.costs.connect_s();
  const bool is_redirected = random_.unit() * static_cast<double>(ready_servers) >= 1;
  return is_redirected ? 2 * once_s + settings_.costs.redirect_ms / 1e3 : once_s;
}

// Levels that the server does not have come from the shared cache, one hairstyle after another.
double Simulation::level_wait_s(Server& server, std::uint32_t hairstyle) {
  const auto now_s = static_cast<double>(now_s_);
  double& at_s = server.hairstyle_at_s[hairstyle];
  if (std::isinf(at_s)) {
    server.loader_free_at_s = std::max(server.loader_free_at_s, now_s) + settings_.costs.level_load_s;
    at_s = server.loader_free_at_s;
    ++server.hairstyles;
  }
  return std::max(0.0, at_s - now_s);
}

void Simulation::take_departures() {
  for (const PersonId id : std::exchange(departures_[static_cast<std::size_t>(now_s_)], {})) leave(id);
}

void Simulation::leave(PersonId id) {
  const RoomId room_id = people_[id].room;
  Room& room = rooms_[room_id];
  const PersonId last = room.members.back();
  room.members[people_[id].place] = last;
  people_[last].place = people_[id].place;
  room.members.pop_back();
  --member_count_;
  ++outcome_.left;
  remove_person(id);
  update_load(room_id);
  if (room.state == Room::State::owned) --servers_[room.owner].people;
  if (!room.members.empty()) return;
  room.empty_since_s = now_s_;
  empty_.emplace_back(now_s_, room_id);
}

// Adds the second that has passed to the outcome, and to the present sample.
void Simulation::account() {
  Outcome& o = outcome_;
  const std::size_t ready = count(Server::State::ready);
  const double needed = std::ceil(cpu_s_ / settings_.capacity());
  double cpu_max_s = 0;
  for (const ServerSlot slot : active_) {
    const Server& server = servers_[slot];
    if (server.state != Server::State::ready) continue;
    cpu_max_s = std::max(cpu_max_s, server.cpu_s);
    if (server.cpu_s > settings_.capacity()) o.coarse_people_sum_s += server.people;
    o.server_bytes_max = std::max(o.server_bytes_max, settings_.costs.process_mb * 1e6 +
                                                          server.hairstyles * settings_.costs.hairstyle_mb * 1e6 +
                                                          server.people * settings_.costs.session_kb * 1e3);
  }
  const double mean_cpu_s = ready > 0 ? cpu_s_ / static_cast<double>(ready) : 0;
  // The histogram takes nanoseconds. A ratio of 1 is recorded as 1e6 of them and so reads as one millisecond.
  if (mean_cpu_s > 0) o.balance.record(std::llround(cpu_max_s / mean_cpu_s * 1e6));
  const auto people_now = static_cast<double>(people()), running = static_cast<double>(active_.size());
  o.seconds += 1;
  o.people_sum_s += people_now;
  o.people_max = std::max(o.people_max, people_now);
  o.server_seconds += running;
  o.servers_max = std::max(o.servers_max, running);
  o.servers_needed_sum_s += needed;
  o.servers_needed_max = std::max(o.servers_needed_max, needed);
  o.egress_bytes += bytes_per_s_;
  o.egress_bytes_per_s_max = std::max(o.egress_bytes_per_s_max, bytes_per_s_);
  o.rooms_overloaded_max = std::max(o.rooms_overloaded_max, static_cast<double>(overloaded_now_));
  o.etcd.add(second_);
  for (std::size_t i = 0; i < kEtcdWriteCount; ++i)
    o.etcd_max.writes[i] = std::max(o.etcd_max.writes[i], second_.writes[i]);
  o.etcd_max.watch_events = std::max(o.etcd_max.watch_events, second_.watch_events);
  o.etcd_writes_max = std::max(o.etcd_writes_max, second_.total());

  Sample& s = interval_;
  s.seconds += 1;
  s.people += people_now;
  s.waiting += static_cast<double>(waiting_count_);
  s.servers_needed += needed;
  s.servers_running += static_cast<double>(ready);
  s.used_share += mean_cpu_s / settings_.capacity();
  s.used_share_max = std::max(s.used_share_max, cpu_max_s / settings_.capacity());
  s.egress_bytes_per_s += bytes_per_s_;
  s.etcd.add(std::exchange(second_, {}));
  if ((now_s_ + 1) % interval_seconds_ != 0 && now_s_ + 1 != end_s_) return;
  s.hour = (static_cast<double>(now_s_) + 1 - s.seconds / 2) / 3600;
  for (double* mean :
       {&s.people, &s.waiting, &s.servers_needed, &s.servers_running, &s.used_share, &s.egress_bytes_per_s})
    *mean /= s.seconds;
  o.samples.push_back(std::exchange(interval_, {}));
}

std::string Simulation::fault() const {
  std::size_t members = 0, waiting = 0, owned = 0;
  double cpu_s = 0;
  for (RoomId id = 0; id < rooms_.size(); ++id) {
    const Room& room = rooms_[id];
    members += room.members.size();
    waiting += room.waiting.size();
    for (std::size_t i = 0; i < room.members.size(); ++i) {
      const Person& person = people_[room.members[i]];
      if (person.room != id || person.place != i || !person.is_member) return fmt::format("a member of {} is not", id);
    }
    if (settings_.room_cap != 0 && room.members.size() + room.waiting.size() > settings_.room_cap)
      return fmt::format("room {} is over its cap", id);
    if (room.owner == kNone) {
      if (room.state == Room::State::owned) return fmt::format("room {} is owned by nobody", id);
      continue;
    }
    ++owned;
    const Server& owner = servers_[room.owner];
    if (room.place >= owner.rooms.size() || owner.rooms[room.place] != id)
      return fmt::format("room {} is not in its owner's list", id);
    // A room without service is in the list of a dead server until that server's lease ends.
    const auto expected = room.state == Room::State::owned ? Server::State::ready : Server::State::dead;
    if (owner.state != expected) return fmt::format("room {} has an owner in the wrong state", id);
    if (room.state == Room::State::owned) cpu_s += room.cpu_s;
  }
  std::size_t listed = 0;
  for (const Server& server : servers_) {
    listed += server.rooms.size();
    if (server.state == Server::State::ended && !server.rooms.empty()) return "a server that has ended has rooms";
    double own_s = 0;
    std::size_t own_people = 0;
    for (const RoomId room : server.rooms) {
      own_s += rooms_[room].cpu_s;
      own_people += rooms_[room].members.size();
    }
    if (server.state != Server::State::ready) continue;
    // Loads are sums that many arrivals and departures have changed, so rounding errors remain.
    if (std::abs(own_s - server.cpu_s) > 1e-6) return "a server's load is not the sum of its rooms'";
    if (own_people != server.people) return "a server's people are not the sum of its rooms'";
  }
  if (listed != owned) return "a room is in two servers' lists";
  if (std::abs(cpu_s - cpu_s_) > 1e-6) return "the fleet's load is not the sum of its rooms'";
  if (members != member_count_ || waiting != waiting_count_) return "people are not counted right";
  const Outcome& o = outcome_;
  if (o.at_start + o.arrived != o.left + o.turned_away_rooms_full + o.turned_away_no_server + people())
    return "people are lost, or made of nothing";
  return {};
}

Outcome simulate(const Settings& settings) {
  Simulation simulation(settings);
  while (!simulation.is_done()) simulation.step();
  return simulation.outcome();
}

}  // namespace hairnet::fleet_plan
