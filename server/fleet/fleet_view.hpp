#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/fleet/etcd_api.hpp"
#include "server/fleet/fleet_counters.hpp"
#include "server/fleet/server_status.hpp"

namespace hairnet::server {

// Bounds of the copy: without them, anyone who can write to etcd could fill this server's memory.
inline constexpr std::size_t kFleetServersMax = 4096, kFleetRoomsMax = 131'072;

// The keys of one fleet. Several fleets can share an etcd, each under its own name.
struct FleetKeys {
  explicit FleetKeys(const std::string& fleet)
      : prefix("/hairnet/" + fleet + "/"),
        servers(prefix + "servers/"),
        rooms(prefix + "rooms/"),
        kept(prefix + "kept/") {}
  // One watch covers the keys from `rooms` to the end of `servers`, since these prefixes follow each other in etcd's
  // order.
  std::string prefix, servers, rooms;
  // The texts that move with rooms are not watched: a claim reads that of its room.
  std::string kept;
  [[nodiscard]] std::string of_server(std::uint64_t id) const;
  [[nodiscard]] std::string of_room(std::string_view room) const { return rooms + std::string(room); }
  [[nodiscard]] std::string of_kept(std::string_view room) const { return kept + std::string(room); }
};

// Counts the entries that are skipped, too long or not valid, and warns of each value once (event fleet_entry_skipped).
class SkippedEntries {
 public:
  explicit SkippedEntries(FleetCounters& counters) : counters_(&counters) {}
  void add(const etcd::KeyValue& entry);
  void add_beyond_bound() { counters_->entries_refused_full.add(); }

 private:
  // announced_ has at most this many entries. Beyond, it is emptied, and some warnings come again.
  static constexpr std::size_t kAnnouncedMax = 1000;
  FleetCounters* counters_;
  // Revisions of values that have had a warning. A revision names a value, and takes less memory than its key.
  std::set<std::int64_t> announced_;
};

// A copy of etcd's entries of one fleet, at a revision. It may be old; only a claim decides which server owns a room.
class FleetView {
 public:
  struct Owner {
    std::uint64_t server_id = 0;
    // `claim` is the number of the claim: the revision at which the key was created. `lease` is the lease of the key,
    // and so of its owner.
    std::int64_t claim = 0, lease = 0;
  };

  // `keys` and `skipped` must outlive the view.
  FleetView(const FleetKeys& keys, SkippedEntries& skipped) : keys_(&keys), skipped_(&skipped) {}

  // Takes an entry, or its deletion. Entries that are not valid, and those beyond the bounds, are skipped.
  // Returns the room that has changed; none for a server, or when nothing has.
  std::optional<std::string> apply(const etcd::Change& change);
  // These three return null when the copy has no such entry. The pointers are valid until the next apply(). server_of()
  // takes a whole key, as FleetKeys::of_server() makes it.
  [[nodiscard]] const ServerStatus* server(std::uint64_t id) const;
  [[nodiscard]] const ServerStatus* server_of(std::string_view key) const;
  [[nodiscard]] const Owner* owner(std::string_view room) const;
  [[nodiscard]] const std::map<std::uint64_t, ServerStatus>& servers() const { return servers_; }
  [[nodiscard]] const std::map<std::string, Owner, std::less<>>& rooms() const { return rooms_; }

  // The view contains all changes up to this revision of etcd. Who calls apply() keeps it up to date.
  std::int64_t revision = 0;

 private:
  void apply_server(std::uint64_t id, const etcd::Change& change);

  const FleetKeys* keys_;
  SkippedEntries* skipped_;
  std::map<std::uint64_t, ServerStatus> servers_;
  std::map<std::string, Owner, std::less<>> rooms_;
};

}  // namespace hairnet::server
