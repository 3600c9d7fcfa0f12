#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/fleet/directory.hpp"
#include "server/fleet/etcd_calls.hpp"
#include "server/fleet/etcd_copy.hpp"
#include "server/fleet/etcd_directory_def.hpp"
#include "server/fleet/etcd_entry.hpp"
#include "server/fleet/etcd_kept.hpp"
#include "server/fleet/etcd_lease.hpp"
#include "server/fleet/fleet_counters.hpp"

namespace hairnet::server {

// The rooms that this server claims, owns or releases, with what is kept of them, and those that it has handed over.
// Each room has at most one call under way; a room that needs one and has none is in due_. I/O thread.
class EtcdRooms {
 public:
  // The first six must outlive the rooms. `emit` is set, and takes what happens to rooms.
  EtcdRooms(const EtcdDirectoryDef& def, EtcdCalls& calls, EtcdLease& lease, const EtcdEntry& entry, EtcdCopy& copy,
            FleetCounters& counters, std::function<void(FleetEvent)> emit);

  // These are as in Directory.
  [[nodiscard]] Placement where(std::string_view name, std::int64_t now_ns) const;
  bool claim(std::string_view name, std::int64_t now_ns);
  void release(std::string_view name);
  void hand_over(std::string_view name, std::uint64_t to);
  void keep(std::string_view name, std::string text);
  [[nodiscard]] std::vector<std::string> owned() const;

  // The number of our claim, whatever the fence says; zero: the room is not ours.
  [[nodiscard]] std::int64_t claim_of(std::string_view name) const;
  // Rooms that are claimed, owned or being released.
  [[nodiscard]] std::size_t count() const { return rooms_.size(); }
  void poll(std::int64_t now_ns);
  // The event that the room is claimed has been taken: now clients may enter.
  void on_announced(std::string_view name);
  // The keys have gone with the lease: what was owned is claimed again.
  void on_lease_lost();
  // The copy has got news of a room at this revision; or of any room.
  void check(const std::string& name, std::int64_t revision);
  void check_all();
  void clear();

 private:
  struct Room {
    enum class State : std::uint8_t { claiming, owned, releasing };
    State state = State::claiming;
    // The number of our claim, in `owned` and `releasing`.
    std::int64_t claim = 0;
    // A new claim is given up at this time; zero: the room was ours, and the outcome must be known.
    std::int64_t give_up_ns = 0;
    // No call begins before this time.
    std::int64_t try_at_ns = 0;
    // The call under way; zero: there is none.
    std::uint64_t call = 0;
    // What an earlier owner has kept makes the answer to a claim too long.
    bool skips_kept = false;
    // room_claimed has been taken, in `owned`.
    bool is_announced = false;
    // etcd may have executed a claim under this lease, in `claiming`.
    bool is_sent = false;
    // In `claiming`, false means that the room is released once the outcome is known; in `releasing`, true means that
    // it is claimed again.
    bool is_wanted = true;
  };
  struct HandOver {
    std::uint64_t to = 0;
    // The copy has shown the release first at this time; zero: not yet.
    std::int64_t released_ns = 0;
    // room_handed_over has been emitted.
    bool is_announced = false;
  };

  void add(const std::string& name, const Room& room);
  void forget(const std::string& name);
  void poll_rooms(std::int64_t now_ns);
  void poll_hand_overs(std::int64_t now_ns);
  std::uint64_t send_claim(const std::string& name, const Room& room, std::int64_t now_ns);
  std::uint64_t send_release(const std::string& name, const Room& room, std::int64_t now_ns);
  void retry(const std::string& name);
  void claim_again(const std::string& name, Room& room);
  [[nodiscard]] bool take_claim(const std::string& name, std::int64_t lease, const etcd::TxnAnswer& answer,
                                std::int64_t now_ns);
  void win(const std::string& name, Room& room, std::int64_t claim, const etcd::KeyValue* kept);
  void lose(const std::string& name, std::uint64_t owner, std::string reason);
  void shorten_claim(const std::string& name);
  void take_release(const std::string& name, std::int64_t now_ns);
  void give_up(const std::string& name);

  const EtcdDirectoryDef* def_;
  EtcdCalls* calls_;
  EtcdLease* lease_;
  const EtcdEntry* entry_;
  EtcdCopy* copy_;
  FleetCounters* counters_;
  std::function<void(FleetEvent)> emit_;
  FleetKeys keys_;
  EtcdKept kept_;
  std::map<std::string, Room, std::less<>> rooms_;
  // These rooms need a call and have none.
  std::set<std::string> due_;
  std::map<std::string, HandOver, std::less<>> hand_overs_;
};

}  // namespace hairnet::server
