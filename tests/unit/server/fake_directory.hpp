#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "server/fleet/directory.hpp"

namespace hairnet::server {

// The server under test, and the other server of its fleet.
inline constexpr std::uint64_t kOwnId = 1, kOtherId = 2;

// A server of the fleet that has room for 100 characters, and otherwise the defaults of ServerStatus.
inline ServerStatus server_at(std::uint64_t id, std::string host, std::uint16_t port) {
  ServerStatus status;
  status.id = id;
  status.address = {std::move(host), port, ""};
  status.load.free_characters = 100;
  return status;
}

// A directory (directory.hpp) without etcd, which answers what the test has put into `places`. A room that is claimed
// or released is pending until the test calls decide() or put_elsewhere(). The other members record what the server
// under test has asked for.
class FakeDirectory final : public Directory {
 public:
  [[nodiscard]] Placement where(std::string_view room, std::int64_t) const override {
    if (const auto found = places.find(std::string(room)); found != places.end()) return found->second;
    return {.kind = Placement::Kind::unowned};
  }
  [[nodiscard]] bool holds(std::string_view room, std::int64_t) const override {
    const auto found = places.find(std::string(room));
    return is_open && found != places.end() && found->second.kind == Placement::Kind::here;
  }
  bool claim(std::string_view room, std::int64_t) override {
    if (is_draining) return false;
    claimed.emplace_back(room);
    places[std::string(room)].kind = Placement::Kind::pending;
    return true;
  }
  void release(std::string_view room, std::int64_t) override {
    released.emplace_back(room);
    places[std::string(room)].kind = Placement::Kind::pending;
  }
  void hand_over(std::string_view room, std::uint64_t to, std::int64_t now_ns) override {
    handed_over[std::string(room)] = to;
    release(room, now_ns);
  }
  void keep(std::string_view room, std::string text, std::int64_t) override {
    kept[std::string(room)] = std::move(text);
  }
  void decide(const std::string& room, Placement::Kind kind) { places[room].kind = kind; }
  void put_elsewhere(const std::string& room, std::uint64_t id, ServerAddress address) {
    places[room] = {.kind = Placement::Kind::elsewhere, .server_id = id, .address = std::move(address)};
  }
  void tell(const ServerLoad&) override {}
  void drain(std::int64_t) override {
    is_draining = true;
    all[0].draining = true;
  }
  void pass_on(std::vector<ContentHash> grooms) override { passed_on = std::move(grooms); }
  void stop(std::int64_t) override {}
  [[nodiscard]] bool is_stopped() const override { return false; }
  void poll(std::int64_t) override {}
  std::vector<FleetEvent> take_events() override { return {}; }
  [[nodiscard]] std::uint64_t server_id() const override { return kOwnId; }
  [[nodiscard]] bool is_reachable() const override { return true; }
  [[nodiscard]] std::vector<ServerStatus> servers() const override { return all; }
  [[nodiscard]] std::vector<RoomOwner> rooms() const override { return {}; }
  [[nodiscard]] std::vector<std::string> own_rooms() const override {
    std::vector<std::string> own;
    for (const auto& [room, placement] : places) {
      if (placement.kind == Placement::Kind::here) own.push_back(room);
    }
    return own;
  }

  // What where() answers, by room; other rooms are unowned.
  std::map<std::string, Placement> places;
  // By room: the text of the last keep(), and the server of the last hand_over().
  std::map<std::string, std::string> kept;
  std::map<std::string, std::uint64_t> handed_over;
  // The servers of the fleet, this one first.
  std::vector<ServerStatus> all{server_at(kOwnId, "hair-1", 7420)};
  std::vector<std::string> claimed, released;
  std::vector<ContentHash> passed_on;
  // `is_open` is false while the lease of this server may have ended: holds() then returns false for all rooms.
  bool is_draining = false, is_open = true;
};

}  // namespace hairnet::server
