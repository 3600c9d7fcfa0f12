#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/fleet/etcd_calls.hpp"
#include "server/fleet/etcd_directory_def.hpp"
#include "server/fleet/fleet_counters.hpp"
#include "server/fleet/fleet_view.hpp"

namespace hairnet::server {

// The copy of all entries of servers and rooms: a list fills it at the start and after a compaction, a watch keeps it
// up to date. It may be behind etcd at any time, so nothing that needs to be exact may rest on it: a claim is decided
// by etcd's transaction. I/O thread.
class EtcdCopy {
 public:
  // What happens to the copy. All are set.
  struct Callbacks {
    // A list is complete: any entry may have changed.
    std::function<void()> on_listed;
    // A room has changed, at this revision. The copy has it.
    std::function<void(const std::string& room, std::int64_t revision)> on_room;
    // An entry that is not a room's has changed. The copy has it, unless it is not valid.
    std::function<void(const etcd::KeyValue& entry)> on_server;
    // Rooms have changed: comes once after the calls of on_room for an answer.
    std::function<void()> on_news;
  };
  // The first three must outlive the copy.
  EtcdCopy(const EtcdDirectoryDef& def, EtcdCalls& calls, FleetCounters& counters, Callbacks callbacks);

  [[nodiscard]] const FleetView& view() const { return view_; }
  // The copy has been complete once.
  [[nodiscard]] bool is_listed() const { return is_listed_; }
  void poll(std::int64_t now_ns);
  // Somebody waits for news: a watch that stays silent is soon replaced.
  void look_again(std::int64_t now_ns);
  // Takes an entry that etcd had at this revision, if the copy is older.
  void learn(const etcd::KeyValue& entry, std::int64_t revision);
  // Counts an entry that is too long or not valid, wherever it was read.
  void skip(const etcd::KeyValue& entry) { skipped_.add(entry); }

 private:
  void list_again();
  void take_list(const etcd::RangeAnswer& answer);
  void note_failed_list(EtcdError error);
  [[nodiscard]] bool take_changes(const etcd::WatchAnswer& answer, std::int64_t now_ns);

  EtcdCalls* calls_;
  FleetCounters* counters_;
  Callbacks callbacks_;
  FleetKeys keys_;
  // The connection of a watch that says nothing for two leases (at most 20 s) may have died: a new one goes on where it
  // ended.
  std::int64_t silence_ns_;
  SkippedEntries skipped_;
  FleetView view_, listed_;
  bool is_listed_ = false;
  // Calls.
  std::uint64_t list_ = 0, watch_ = 0;
  // The next list begins here; empty: the list is complete.
  std::string list_from_;
  // Bounds the entries of the next answer; zero: one key, whose value is too long.
  std::int64_t list_page_ = 0;
  std::int64_t watch_until_ns_ = 0;
};

}  // namespace hairnet::server
