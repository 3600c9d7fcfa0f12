#include <algorithm>
#include <utility>

#include "server/fleet/etcd_directory.hpp"

namespace hairnet::server {
namespace {

constexpr std::int64_t kListPage = 1000;
// While somebody waits for news. Not sooner: etcd looks every 100 ms for what a new watch has missed, and what happens
// meanwhile waits for that.
constexpr std::int64_t kAwaitedSilence_ns = 1'000'000'000;

}  // namespace

void EtcdDirectory::poll_view(std::int64_t now_ns) {
  const std::string end = etcd::end_of(keys_.servers);
  if (!list_from_.empty()) {
    if (!is_under_way(Purpose::list))
      start(Purpose::list,
            list_page_ == 0 ? etcd::first_key(list_from_, end, listed_.revision)
                            : etcd::range(list_from_, end, list_page_, listed_.revision),
            now_ns);
    return;
  }
  if (watch_ != 0 && now_ns >= watch_until_ns_) {
    stop_call(watch_);
    watch_ = 0;
  }
  if (watch_ != 0) return;
  counters_->watches.add();
  watch_ = start(Purpose::watch, etcd::watch(keys_.rooms, end, view_.revision + 1), now_ns);
  watch_until_ns_ = now_ns + silence_ns_;
}

void EtcdDirectory::look_again(std::int64_t now_ns) {
  watch_until_ns_ = std::min(watch_until_ns_, now_ns + kAwaitedSilence_ns);
}

void EtcdDirectory::list_again() {
  listed_ = FleetView(keys_, skipped_);
  list_from_ = keys_.rooms;
  list_page_ = kListPage;
}

// All pages show the state at the revision of the first one.
void EtcdDirectory::take_list(const etcd::RangeAnswer& answer) {
  if (listed_.revision == 0) listed_.revision = answer.revision;
  for (etcd::KeyValue entry : answer.entries) {
    entry.is_too_long |= list_page_ == 0;
    listed_.apply({.entry = std::move(entry)});
  }
  list_page_ = std::clamp<std::int64_t>(4 * list_page_, 1, kListPage);
  if (answer.has_more && !answer.entries.empty()) {
    list_from_ = answer.entries.back().key + '\0';
    return;
  }
  counters_->lists.add();
  list_from_.clear();
  is_listed_ = true;
  view_ = std::exchange(listed_, FleetView(keys_, skipped_));
  if (!view_.server(status_.id)) told_.clear();  // somebody else has written or deleted it
  for (const auto& [name, owner] : view_.rooms())
    if (owner.server_id == status_.id) check_room(name, view_.revision);
  std::vector<std::string> own;
  for (const auto& [name, room] : rooms_) own.push_back(name);
  for (const std::string& name : own) check_room(name, view_.revision);
}

void EtcdDirectory::take_watch(std::uint64_t id, const etcd::WatchAnswer& answer, std::int64_t now_ns) {
  if (answer.is_canceled) {
    const Call call = calls_.at(id);
    stop_call(id);
    watch_ = 0;
    if (answer.compact_revision != 0) return list_again();
    return fail(call, EtcdFault::refused, now_ns);
  }
  // A watch that begins later than the newest revision would hear nothing: this etcd has begun anew, without its data.
  if (answer.is_created && answer.revision < view_.revision) {
    stop_call(id);
    watch_ = 0;
    return list_again();
  }
  watch_until_ns_ = now_ns + silence_ns_;
  // The header of an answer with changes may be newer than the last of them.
  const std::int64_t before = view_.revision;
  bool is_news = false;
  if (answer.changes.empty() && !answer.is_created) view_.revision = std::max(before, answer.revision);
  const std::string own_key = keys_.of_server(status_.id);
  for (const etcd::Change& change : answer.changes) {
    const std::int64_t revision = change.entry.mod_revision;
    if (revision <= before) continue;
    view_.revision = std::max(view_.revision, revision);
    if (change.entry.key == own_key && change.entry.lease != lease_) told_.clear();  // somebody else has written it
    if (const auto room = view_.apply(change)) {
      check_room(*room, revision);
      is_news = true;
    } else if (const ServerStatus* server = view_.server_of(change.entry.key);
               server && server->id != status_.id && !server->grooms.empty()) {
      emit({.kind = FleetEvent::Kind::grooms_passed_on, .grooms = server->grooms});
    }
  }
  if (is_news && on_news) on_news();
}

}  // namespace hairnet::server
