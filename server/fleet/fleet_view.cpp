#include "server/fleet/fleet_view.hpp"

#include <spdlog/spdlog.h>

#include "schema/limits.hpp"
#include "server/fleet/fleet_values.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {

std::string FleetKeys::of_server(std::uint64_t id) const {
  return servers + id_text(id);
}

void SkippedEntries::add(const etcd::KeyValue& entry) {
  (entry.is_too_long ? counters_->entries_refused_oversize : counters_->entries_refused_malformed).add();
  // A set that is full forgets everything: some warnings then come again, and the memory stays bounded.
  if (announced_.size() >= kAnnouncedMax) announced_.clear();
  if (!announced_.insert(entry.mod_revision).second) return;
  spdlog::warn("event=fleet_entry_skipped key={} revision={} reason={}", log_text(entry.key), entry.mod_revision,
               entry.is_too_long ? "oversize" : "malformed");
}

std::optional<std::string> FleetView::apply(const etcd::Change& change) {
  // The prefix of the key says what the entry is. An entry that cannot be used leaves the copy as it was: a broken
  // value must not remove a room from its owner.
  const std::string_view key = change.entry.key;
  if (change.entry.is_too_long) {
    skipped_->add(change.entry);
    return {};
  }
  if (key.starts_with(keys_->servers)) {
    if (const auto id = parse_id(key.substr(keys_->servers.size())))
      apply_server(*id, change);
    else
      skipped_->add(change.entry);
    return {};
  }
  if (!key.starts_with(keys_->rooms)) {
    skipped_->add(change.entry);
    return {};
  }
  const std::string_view room = key.substr(keys_->rooms.size());
  const auto known = rooms_.find(room);
  if (change.is_deleted) {
    if (known != rooms_.end()) rooms_.erase(known);
    return std::string(room);
  }
  const auto server_id = parse_owner(change.entry.value);
  if (!wire::is_room_name(room) || !server_id) {
    skipped_->add(change.entry);
    return {};
  }
  // Rooms that are known stay up to date when the copy is full.
  if (known == rooms_.end() && rooms_.size() >= kFleetRoomsMax) {
    skipped_->add_beyond_bound();
    return {};
  }
  rooms_.insert_or_assign(
      std::string(room),
      Owner{.server_id = *server_id, .claim = change.entry.create_revision, .lease = change.entry.lease});
  return std::string(room);
}

void FleetView::apply_server(std::uint64_t id, const etcd::Change& change) {
  if (change.is_deleted) {
    servers_.erase(id);
    return;
  }
  const Result<ServerStatus> status = parse_status(change.entry.value);
  // A value under another server's key would let one entry speak for two servers.
  if (!status || status->id != id) {
    skipped_->add(change.entry);
    return;
  }
  if (!servers_.contains(id) && servers_.size() >= kFleetServersMax) {
    skipped_->add_beyond_bound();
    return;
  }
  servers_.insert_or_assign(id, *status);
}

const ServerStatus* FleetView::server(std::uint64_t id) const {
  const auto found = servers_.find(id);
  return found == servers_.end() ? nullptr : &found->second;
}

const ServerStatus* FleetView::server_of(std::string_view key) const {
  if (!key.starts_with(keys_->servers)) return nullptr;
  const auto id = parse_id(key.substr(keys_->servers.size()));
  return id ? server(*id) : nullptr;
}

const FleetView::Owner* FleetView::owner(std::string_view room) const {
  const auto found = rooms_.find(room);
  return found == rooms_.end() ? nullptr : &found->second;
}

}  // namespace hairnet::server
