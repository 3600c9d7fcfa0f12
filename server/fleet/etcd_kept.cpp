#include <spdlog/spdlog.h>

#include "server/fleet/etcd_directory.hpp"

namespace hairnet::server {
namespace {

// Long enough for the next owner after a server has died, and short enough that what nobody asks for is not left.
constexpr std::int64_t kKeptLease_s = 3600;
constexpr std::int64_t kKeptRenewal_ns = kKeptLease_s / 3 * 1'000'000'000;
constexpr std::size_t kPutsPerPoll = 4;

}  // namespace

void EtcdDirectory::keep(std::string_view name, std::string text, std::int64_t) {
  const auto found = rooms_.find(name);
  if (found == rooms_.end() || found->second.state == Room::State::releasing || found->second.kept == text) return;
  found->second.is_kept |= !text.empty();
  found->second.kept = std::move(text);
  kept_due_.insert(found->first);
}

etcd::Beside EtcdDirectory::kept_of(const std::string& name, const Room& room) const {
  using Action = etcd::Beside::Action;
  const bool is_due = kept_due_.contains(name) || room.kept_call != 0;  // a put under way may fail, or come too late
  if (!is_due || (room.kept.empty() && !room.is_kept)) return {};
  if (room.kept.empty()) return {.action = Action::remove, .key = keys_.of_kept(name)};
  return {.action = Action::put, .key = keys_.of_kept(name), .value = room.kept, .lease = kept_lease_};
}

void EtcdDirectory::poll_kept(std::int64_t now_ns) {
  if (kept_lease_ == 0) {
    if (!kept_due_.empty() && !is_under_way(Purpose::keep_grant))
      start(Purpose::keep_grant, etcd::grant(kKeptLease_s), now_ns);
    return;
  }
  if (now_ns >= kept_renewal_ns_ && !is_under_way(Purpose::keep_renewal))
    start(Purpose::keep_renewal, etcd::keep_alive(kept_lease_), now_ns);
  std::size_t left = kPutsPerPoll;
  for (auto next = kept_due_.begin(); next != kept_due_.end() && left > 0 && calls_.size() < kCallsMax;) {
    const std::string& name = *next;
    Room& room = rooms_.find(name)->second;
    if (room.state != Room::State::owned || room.kept_call != 0 || !fence_.is_open(now_ns)) {
      ++next;
      continue;
    }
    counters_->rooms_kept.add();
    room.kept_call =
        start(Purpose::keep, etcd::put_beside(keys_.of_room(name), room.claim, kept_of(name, room)), now_ns, name);
    next = kept_due_.erase(next);
    --left;
  }
}

void EtcdDirectory::take_kept_lease(const Call& call, const etcd::LeaseAnswer& answer) {
  if (answer.ttl_s == 0) return lose_kept_lease();
  kept_lease_ = answer.lease;
  kept_renewal_ns_ = call.sent_ns + kKeptRenewal_ns;
}

// What was kept has vanished with it: all of it is put again, under another one.
void EtcdDirectory::lose_kept_lease() {
  kept_lease_ = 0;
  for (const auto& [name, room] : rooms_)
    if (!room.kept.empty()) kept_due_.insert(name);
}

void EtcdDirectory::end_keep(const Call& call, bool is_done) {
  const auto found = rooms_.find(call.room);
  if (found == rooms_.end()) return;
  found->second.kept_call = 0;
  if (!is_done) kept_due_.insert(found->first);
}

}  // namespace hairnet::server
