#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "server/app/config.hpp"
#include "server/app/largest_room.hpp"
#include "server/app/metrics.hpp"
#include "server/fleet/balance.hpp"
#include "server/fleet/directory.hpp"
#include "server/fleet/room_place.hpp"

namespace hairnet::server {

class EtcdClient;
class EtcdDirectory;
class EtcdSink;
class EtcdTransport;
class IoLoop;

// This server as a part of a fleet: owns the directory, in etcd or local, publishes the server's load there, and
// decides which room to hand over. I/O thread.
class Fleet {
 public:
  // `port` is the port at which clients reach this server. The error is one line. `loop` and `metrics` must outlive the
  // fleet.
  static Result<std::unique_ptr<Fleet>> create(const Config& config, std::uint16_t port, IoLoop& loop,
                                               Metrics& metrics);
  // With a directory in etcd, for tests: `transport` must outlive the fleet and report to sink(). `id` is this server's
  // id, which is random otherwise.
  static std::unique_ptr<Fleet> create(const Config& config, std::uint16_t port, std::uint64_t id,
                                       EtcdTransport& transport, Metrics& metrics);
  ~Fleet();
  Fleet(const Fleet&) = delete;
  Fleet& operator=(const Fleet&) = delete;

  [[nodiscard]] Directory& directory() { return *directory_; }
  // Whether other servers share the directory.
  [[nodiscard]] bool is_shared() const { return in_etcd_ != nullptr; }
  // A transport reports to this sink; it is null without etcd.
  [[nodiscard]] EtcdSink* sink() const;
  // Sets the address where the settings do not have it, since only Agones knows it.
  void set_address(const ServerAddress& address);
  // The directory works, and this server may have rooms.
  [[nodiscard]] bool is_joined(std::int64_t now_ns) const { return directory_->fence().is_open(now_ns); }
  [[nodiscard]] std::size_t room_count() const;
  // Publishes the server's load, and passes on the directory's events. `takes_clients` says whether the server has a
  // place for one more client. `largest` needs only its rooms and characters; poll() fills in the times of ticks.
  void poll(bool takes_clients, RoomLoad largest, std::int64_t now_ns);
  // The room that is too big for this server; empty: none.
  [[nodiscard]] const std::string& overloaded_room() const { return largest_.overloaded(); }
  // Returns the room that this server should hand over now, if there is one. `characters` returns the number of
  // characters of a room of this server.
  std::optional<RoomMove> choose_move(const std::function<std::size_t(const std::string& room)>& characters,
                                      std::int64_t now_ns);
  [[nodiscard]] RoomPlace find_room(const std::string& room, std::int64_t now_ns) const;
  // These are the bodies of /fleet.json and /fleet.
  [[nodiscard]] std::string json() const;
  [[nodiscard]] std::string html() const;

  // poll() calls it with each event of the directory. May be empty, like on_address.
  std::function<void(const FleetEvent& event, std::int64_t now_ns)> on_event;
  // Called by set_address(), with the address.
  std::function<void(const ServerAddress&)> on_address;

 private:
  Fleet(const Config& config, Metrics& metrics);

  Metrics* metrics_;
  // The server's limits of characters and rooms, and the URL of its own page, from the settings.
  std::size_t character_count_max_, room_count_max_;
  std::string page_;
  LargestRoom largest_;
  // Whether this server gives up rooms when it is short of time (`fleet.balance`).
  bool balances_;
  Balance balance_;
  // Rooms that this server has had for less than kRoomStay_ns, and when it got them.
  std::map<std::string, std::int64_t> claimed_ns_;
  // The transport to etcd; null without etcd, and with a transport of the caller's.
  std::unique_ptr<EtcdClient> client_;
  std::unique_ptr<Directory> directory_;
  // The object of directory_ as a directory in etcd; null without etcd.
  EtcdDirectory* in_etcd_ = nullptr;
};

// Returns the load by the gauges of the tick. While not even the coarsest levels fit the budget, the free share is 0.
// Otherwise it is kAnnouncedShareMin (1/16) at least, because more characters then only mean coarser hair.
ServerLoad measured_load(Metrics& metrics, std::size_t character_count_max);

}  // namespace hairnet::server
