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

// The rooms that this server claims, owns or releases, with their texts (Directory::keep), and the rooms that it has
// handed over. Each room has at most one call under way; a room that needs a call and has none is in due_. I/O thread.
class EtcdRooms {
 public:
  // All but `emit` must outlive this object. `emit`, which must be set, gets the events of rooms.
  EtcdRooms(const EtcdDirectoryDef& def, EtcdCalls& calls, EtcdLease& lease, const EtcdEntry& entry, EtcdCopy& copy,
            FleetCounters& counters, std::function<void(FleetEvent)> emit);

  // These six are as in Directory (directory.hpp).
  [[nodiscard]] Placement where(std::string_view name, std::int64_t now_ns) const;
  bool claim(std::string_view name, std::int64_t now_ns);
  void release(std::string_view name);
  void hand_over(std::string_view name, std::uint64_t to);
  void keep(std::string_view name, std::string text);
  [[nodiscard]] std::vector<std::string> owned() const;

  // The number of this server's claim of the room, also while the fence is closed; zero: this server does not own the
  // room.
  [[nodiscard]] std::int64_t claim_of(std::string_view name) const;
  // Rooms that are claimed, owned or being released.
  [[nodiscard]] std::size_t count() const { return rooms_.size(); }
  // Sends claims, releases and texts that are due, and gives up claims without an outcome. Call it at every poll of the
  // directory.
  void poll(std::int64_t now_ns);
  // The server has taken the event room_claimed, and with it the room's text: from now on clients may enter.
  void on_announced(std::string_view name);
  // The keys of the rooms have vanished from etcd with the lease: the rooms that this server owned are claimed again.
  void on_lease_lost();
  // The copy has changed: the entry of this room, at this revision, or any entries. Compares the copy with the rooms of
  // this server.
  void check(const std::string& name, std::int64_t revision);
  void check_all();
  // Forgets all rooms, at the end of the server.
  void clear();

 private:
  // A room that this server claims, owns or releases. A room that it has released is no entry of rooms_ any more.
  struct Room {
    enum class State : std::uint8_t { claiming, owned, releasing };
    State state = State::claiming;
    // The number of this server's claim, in `owned` and `releasing`.
    std::int64_t claim = 0;
    // A claim of a new room is given up at this time. Zero: this server owned the room before; its sessions are still
    // here, so the claim goes on until its outcome is known.
    std::int64_t give_up_ns = 0;
    // No call begins before this time.
    std::int64_t try_at_ns = 0;
    // The call under way; zero: there is none.
    std::uint64_t call = 0;
    // The answer to a claim was too long with the text of an earlier owner, so the claim does not ask for the text.
    bool skips_kept = false;
    // on_announced() was called, in `owned`.
    bool is_announced = false;
    // etcd may have executed a claim under this lease, in `claiming`.
    bool is_sent = false;
    // In `claiming`, false means that the room is released once the outcome of the claim is known. In `releasing`, true
    // means that the room is claimed again after the release.
    bool is_wanted = true;
  };
  // A room that was released in favour of the server `to`.
  struct HandOver {
    std::uint64_t to = 0;
    // The copy showed the release for the first time at this time; zero: it does not show it yet.
    std::int64_t released_ns = 0;
    // room_handed_over has been emitted.
    bool is_announced = false;
  };

  // Adds the room and puts it into due_.
  void add(const std::string& name, const Room& room);
  // Removes the room from rooms_, due_ and kept_.
  void forget(const std::string& name);
  // Handles the rooms in due_: sends their claims and releases, and gives up or drops those that need none any more.
  void poll_rooms(std::int64_t now_ns);
  // Announces hand-overs that all servers know of by now, and forgets those older than kHandOver_ns.
  void poll_hand_overs(std::int64_t now_ns);
  // These two send the transaction of a claim or of a release, and return the number of the call.
  std::uint64_t send_claim(const std::string& name, const Room& room, std::int64_t now_ns);
  std::uint64_t send_release(const std::string& name, const Room& room, std::int64_t now_ns);
  // The call for the room has ended without an outcome: the room needs another one.
  void retry(const std::string& name);
  // Claims a room that this server has owned. Such a claim is never given up, because sessions are in the room.
  void claim_again(const std::string& name, Room& room);
  // Takes the answer to a claim that was sent under `lease`: wins the room, loses it to another server, or tries again.
  // Returns false when the answer lacks the room's entry, so that the call counts as malformed.
  [[nodiscard]] bool take_claim(const std::string& name, std::int64_t lease, const etcd::TxnAnswer& answer,
                                std::int64_t now_ns);
  // The room is this server's with the number `claim`. `kept` is its entry with the text; null: etcd has no text.
  void win(const std::string& name, Room& room, std::int64_t claim, const etcd::KeyValue* kept);
  // Another server (`owner`; 0: unknown) has the room. Emits room_lost if this server owned it before, else
  // claim_failed.
  void lose(const std::string& name, std::uint64_t owner, std::string reason);
  // The answer to a claim was too long: claims again without asking for the text.
  void shorten_claim(const std::string& name);
  // The room is released. Claims it again if somebody has asked for it meanwhile.
  void take_release(const std::string& name, std::int64_t now_ns);
  // Gives up the claim of a new room that has had no outcome for too long.
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
  // The rooms that need a call and have none.
  std::set<std::string> due_;
  std::map<std::string, HandOver, std::less<>> hand_overs_;
};

}  // namespace hairnet::server
