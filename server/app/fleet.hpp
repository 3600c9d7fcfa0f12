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

// This server's place in a fleet: its directory, in etcd or its own, and what the directory is told. I/O thread.
class Fleet {
 public:
  // `port` is the public one. The error is one line. `loop` and `metrics` must outlive it.
  static Result<std::unique_ptr<Fleet>> create(const Config& config, std::uint16_t port, IoLoop& loop,
                                               Metrics& metrics);
  // In etcd, through a transport of the caller's, which outlives it and gets `sink()`. `id`: of this server.
  static std::unique_ptr<Fleet> create(const Config& config, std::uint16_t port, std::uint64_t id,
                                       EtcdTransport& transport, Metrics& metrics);
  ~Fleet();
  Fleet(const Fleet&) = delete;
  Fleet& operator=(const Fleet&) = delete;

  [[nodiscard]] Directory& directory() { return *directory_; }
  // Is true when other servers share the directory.
  [[nodiscard]] bool is_shared() const { return in_etcd_ != nullptr; }
  // A transport reports to this sink; it is null without etcd.
  [[nodiscard]] EtcdSink* sink() const;
  // Sets the address where the settings do not have it, since only Agones knows it.
  void set_address(const ServerAddress& address);
  // The directory works, and this server may have rooms.
  [[nodiscard]] bool is_joined(std::int64_t now_ns) const { return directory_->fence().is_open(now_ns); }
  [[nodiscard]] std::size_t room_count() const;
  // `takes_clients`: whether the server has a place for one more. `largest` may leave out what ticks take.
  void poll(bool takes_clients, RoomLoad largest, std::int64_t now_ns);
  // The room that is too big for this server; empty: none.
  [[nodiscard]] const std::string& overloaded_room() const { return largest_.overloaded(); }
  // The room that this server should hand over now. `characters`: of a room of this server.
  std::optional<RoomMove> choose_move(const std::function<std::size_t(const std::string& room)>& characters,
                                      std::int64_t now_ns);
  [[nodiscard]] RoomPlace find_room(const std::string& room, std::int64_t now_ns) const;
  // These are the bodies of /fleet.json and /fleet.
  [[nodiscard]] std::string json() const;
  [[nodiscard]] std::string html() const;

  // May be empty, like the next one.
  std::function<void(const FleetEvent& event, std::int64_t now_ns)> on_event;
  // Is called with the address that set_address() was told.
  std::function<void(const ServerAddress&)> on_address;

 private:
  Fleet(const Config& config, Metrics& metrics);

  Metrics* metrics_;
  std::size_t character_count_max_, room_count_max_;
  std::string page_;
  LargestRoom largest_;
  bool balances_;
  Balance balance_;
  // Rooms that this server has had for less than kRoomStay_ns, and when it got them.
  std::map<std::string, std::int64_t> claimed_ns_;
  // Is null without etcd, and over a transport of the caller's.
  std::unique_ptr<EtcdClient> client_;
  std::unique_ptr<Directory> directory_;
  // Is the same directory, or null without etcd.
  EtcdDirectory* in_etcd_ = nullptr;
};

// The load by the gauges of the tick. While not even the coarsest levels fit the budget the free share is 0; else it is
// a sixteenth at least, for then more characters only mean coarser hair.
ServerLoad measured_load(Metrics& metrics, std::size_t character_count_max);

}  // namespace hairnet::server
