#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/fleet/etcd_calls.hpp"
#include "server/fleet/etcd_directory_def.hpp"
#include "server/fleet/fleet_counters.hpp"
#include "server/fleet/fleet_view.hpp"

namespace hairnet::server {

// This server's copy of all entries of servers and rooms in etcd. A list of all keys fills the copy at the start and
// after a compaction of etcd; then a watch keeps it up to date. The copy may be older than etcd at any time, so no
// decision about ownership may rest on it: etcd's transaction decides a claim. I/O thread.
class EtcdCopy {
 public:
  // The copy calls these when it changes. All are set.
  struct Callbacks {
    // A list is complete: any entry may have changed.
    std::function<void()> on_listed;
    // A room has changed, at this revision. The copy has it.
    std::function<void(const std::string& room, std::int64_t revision)> on_room;
    // An entry that is not a room's has changed. The copy has it, unless it is not valid.
    std::function<void(const etcd::KeyValue& entry)> on_server;
    // Rooms have changed. It is called once for each answer of the watch, after all its calls of on_room.
    std::function<void()> on_news;
  };
  // `calls` and `counters` must outlive the copy.
  EtcdCopy(const EtcdDirectoryDef& def, EtcdCalls& calls, FleetCounters& counters, Callbacks callbacks);

  [[nodiscard]] const FleetView& view() const { return view_; }
  // The copy has been complete once.
  [[nodiscard]] bool is_listed() const { return is_listed_; }
  // Sends the next page of the list, or the watch, when none is under way; replaces a watch that is silent for too
  // long.
  void poll(std::int64_t now_ns);
  // See Directory::look_again(): a watch that stays silent for one more second is replaced.
  void look_again(std::int64_t now_ns);
  // Puts an entry into the copy that a transaction has read at this revision, unless the copy is as new.
  void learn(const etcd::KeyValue& entry, std::int64_t revision);
  // Counts an entry that is too long or not valid, wherever it was read.
  void skip(const etcd::KeyValue& entry) { skipped_.add(entry); }

 private:
  // Begins a new list. The present copy answers until the list is complete.
  void list_again();
  // Takes one page of the list.
  void take_list(const etcd::RangeAnswer& answer);
  // A page was too long, so the next one is smaller; after any other error the list begins again.
  void note_failed_list(EtcdError error);
  // Takes an answer of the watch. Returns false when etcd refuses the watch.
  [[nodiscard]] bool take_changes(const etcd::WatchAnswer& answer, std::int64_t now_ns);

  EtcdCalls* calls_;
  FleetCounters* counters_;
  Callbacks callbacks_;
  FleetKeys keys_;
  // A watch that brings nothing for this long, two leases but at most 20 s, is replaced, because its connection may
  // have died. The new watch goes on where the old one ended.
  std::int64_t silence_ns_;
  SkippedEntries skipped_;
  // The copy that answers, and the one that the list under way fills; listed_ replaces view_ when the list is complete.
  FleetView view_, listed_;
  bool is_listed_ = false;
  // The numbers of the calls in EtcdCalls; zero: there was none yet.
  std::uint64_t list_ = 0, watch_ = 0;
  // The next page of the list begins at this key; empty: the list is complete.
  std::string list_from_;
  // The next page has at most this many entries; zero: it is the first key without its value, which alone exceeds
  // kAnswerBytesMax.
  std::int64_t list_page_ = 0;
  // The watch is replaced if it has brought nothing by this time.
  std::int64_t watch_until_ns_ = 0;
};

}  // namespace hairnet::server
