#include "server/fleet/etcd_copy.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::server {
namespace {

// A page of the list has at most this many entries. With values of usual length a page stays below kAnswerBytesMax (4
// MiB); one that exceeds it is asked for again in smaller pages.
constexpr std::int64_t kListPage = 1000;
// A list may take this long. Other requests have less time (EtcdCalls), but the list is long, and no client enters a
// room before the first one is complete.
constexpr std::int64_t kListTimeout_ns = 2'000'000'000;
// A watch whose connection has died without a word is noticed after this time at the latest.
constexpr std::int64_t kSilenceMax_ns = 20'000'000'000;
// A silent watch is replaced after this time while a client waits for a room. A much shorter time would delay changes:
// etcd looks only every 100 ms for changes that a new watch has missed, and changes that come meanwhile wait for that.
constexpr std::int64_t kAwaitedSilence_ns = 1'000'000'000;

}  // namespace

EtcdCopy::EtcdCopy(const EtcdDirectoryDef& def, EtcdCalls& calls, FleetCounters& counters, Callbacks callbacks)
    : calls_(&calls),
      counters_(&counters),
      callbacks_(std::move(callbacks)),
      keys_(def.fleet),
      silence_ns_(std::min(2 * def.lease_ns(), kSilenceMax_ns)),
      skipped_(counters),
      view_(keys_, skipped_),
      listed_(keys_, skipped_) {
  list_again();
}

void EtcdCopy::poll(std::int64_t now_ns) {
  const std::string end = etcd::end_of(keys_.servers);
  if (!list_from_.empty()) {
    if (calls_->is_under_way(list_)) return;
    const auto take = [this](const auto& answer, auto) { take_list(answer); };
    list_ = calls_->start({.request = list_page_ == 0 ? etcd::first_key(list_from_, end, listed_.revision)
                                                      : etcd::range(list_from_, end, list_page_, listed_.revision),
                           .timeout_ns = kListTimeout_ns,
                           .on_answer = calls_->reading(etcd::parse_range, take),
                           .on_failure = [this](EtcdError error, auto) { note_failed_list(error); }},
                          now_ns);
    return;
  }
  // A watch that brings nothing may have a dead connection. The new one begins after the last revision of the copy, so
  // no change is lost.
  if (now_ns >= watch_until_ns_) calls_->stop(watch_);
  if (calls_->is_under_way(watch_)) return;
  counters_->watches.add();
  const auto note_failure = [this](EtcdError error, auto) {
    // A watch that begins where this one has ended would get the same line again, so a list passes over it.
    if (error == EtcdError::oversize || error == EtcdError::malformed) list_again();
  };
  watch_ = calls_->start({.request = etcd::watch(keys_.rooms, end, view_.revision + 1),
                          .on_change = [this](const auto& answer, auto at_ns) { return take_changes(answer, at_ns); },
                          .on_failure = note_failure},
                         now_ns);
  watch_until_ns_ = now_ns + silence_ns_;
}

void EtcdCopy::look_again(std::int64_t now_ns) {
  watch_until_ns_ = std::min(watch_until_ns_, now_ns + kAwaitedSilence_ns);
}

void EtcdCopy::learn(const etcd::KeyValue& entry, std::int64_t revision) {
  // An older entry must not replace a newer one that the watch has brought.
  if (revision > view_.revision) view_.apply({.entry = entry});
}

void EtcdCopy::list_again() {
  // The list fills a second copy: the first one answers until the list is complete.
  listed_ = FleetView(keys_, skipped_);
  list_from_ = keys_.rooms;
  list_page_ = kListPage;
}

void EtcdCopy::note_failed_list(EtcdError error) {
  if (error == EtcdError::oversize && list_page_ > 0)
    // The next page has a quarter of the entries, down to one. Then this one key is asked for without its value: a
    // value that alone exceeds the bound is skipped.
    list_page_ = list_page_ > 1 ? std::max<std::int64_t>(list_page_ / 4, 1) : 0;
  else
    list_again();
}

// All pages show the state at the revision of the first one.
void EtcdCopy::take_list(const etcd::RangeAnswer& answer) {
  if (listed_.revision == 0) listed_.revision = answer.revision;
  for (etcd::KeyValue entry : answer.entries) {
    entry.is_too_long |= list_page_ == 0;
    listed_.apply({.entry = std::move(entry)});
  }
  // Pages grow back to kListPage by a factor of 4, and not at once, because the next entries may be long, too.
  list_page_ = std::clamp<std::int64_t>(4 * list_page_, 1, kListPage);
  if (answer.has_more && !answer.entries.empty()) {
    // A zero byte at the end of the last key makes the smallest key that comes after it.
    list_from_ = answer.entries.back().key + '\0';
    return;
  }
  counters_->lists.add();
  list_from_.clear();
  is_listed_ = true;
  view_ = std::exchange(listed_, FleetView(keys_, skipped_));
  callbacks_.on_listed();
}

// Returns false when etcd refuses the watch.
bool EtcdCopy::take_changes(const etcd::WatchAnswer& answer, std::int64_t now_ns) {
  const bool is_compacted = answer.is_canceled && answer.compact_revision != 0;
  if (answer.is_canceled && !is_compacted) return false;
  // The copy's revision is newer than etcd's newest one: etcd has lost its data and counts from the start. A watch from
  // the copy's revision on would get nothing.
  if (is_compacted || (answer.is_created && answer.revision < view_.revision)) {
    calls_->stop(watch_);
    list_again();
    return true;
  }
  watch_until_ns_ = now_ns + silence_ns_;
  // The header of an answer with changes may be newer than the last of them.
  const std::int64_t before = view_.revision;
  bool is_news = false;
  if (answer.changes.empty() && !answer.is_created) view_.revision = std::max(before, answer.revision);
  for (const etcd::Change& change : answer.changes) {
    const std::int64_t revision = change.entry.mod_revision;
    // A watch may repeat changes that an earlier one has brought.
    if (revision <= before) continue;
    view_.revision = std::max(view_.revision, revision);
    if (const auto room = view_.apply(change)) {
      callbacks_.on_room(*room, revision);
      is_news = true;
    } else {
      callbacks_.on_server(change.entry);
    }
  }
  if (is_news) callbacks_.on_news();
  return true;
}

}  // namespace hairnet::server
