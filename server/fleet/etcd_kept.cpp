#include "server/fleet/etcd_kept.hpp"

#include <utility>

namespace hairnet::server {
namespace {

// The lease of the texts, an hour: after a server has died, the next owners of its rooms have this long to claim them,
// and then texts that nobody has asked for vanish. The lease is renewed after a third of its time.
constexpr std::int64_t kKeptLease_s = 3600;
constexpr std::int64_t kKeptRenewal_ns = kKeptLease_s / 3 * 1'000'000'000;
// One poll writes at most this many texts: a text may have 60 KiB, and claims of rooms count in the same bound of calls
// (EtcdCalls::is_full).
constexpr std::size_t kPutsPerPoll = 4;

}  // namespace

EtcdKept::EtcdKept(const FleetKeys& keys, EtcdCalls& calls, FleetCounters& counters)
    : keys_(&keys), calls_(&calls), counters_(&counters) {}

void EtcdKept::forget(const std::string& room) {
  texts_.erase(room);
  due_.erase(room);
}

void EtcdKept::clear() {
  texts_.clear();
  due_.clear();
}

void EtcdKept::put(const std::string& room, std::string text) {
  Text& kept = texts_.at(room);
  // The caller writes at each change of anything; the same text needs no write.
  if (kept.text == text) return;
  kept.is_kept |= !text.empty();
  kept.text = std::move(text);
  due_.insert(room);
}

const std::string& EtcdKept::take(const std::string& room, const etcd::KeyValue* found, bool was_ours) {
  Text& kept = texts_.at(room);
  // If etcd has no text of a room that was this server's, the text here stays: etcd has lost its data, or was out of
  // reach for longer than the lease of the texts.
  if (!due_.contains(room) && (found || !was_ours)) kept.text = found ? found->value : std::string();
  kept.is_kept = found || !kept.text.empty();
  // The text is put again under a lease of ours, because that of its former owner may end.
  if (!kept.text.empty()) due_.insert(room);
  return kept.text;
}

bool EtcdKept::may_release(const std::string& room) const {
  return lease_ != 0 || !due_.contains(room);
}

etcd::Beside EtcdKept::beside_release(const std::string& room) const {
  using Action = etcd::Beside::Action;
  const Text& kept = texts_.at(room);
  // A write that is under way may fail, or be executed after the release, so the release writes the text again.
  const bool is_due = due_.contains(room) || kept.call != 0;
  if (!is_due || (kept.text.empty() && !kept.is_kept)) return {};
  if (kept.text.empty()) return {.action = Action::remove, .key = keys_->of_kept(room)};
  return {.action = Action::put, .key = keys_->of_kept(room), .value = kept.text, .lease = lease_};
}

void EtcdKept::poll(const std::function<std::int64_t(const std::string& room)>& claim_of, std::int64_t now_ns) {
  const auto take = [this, now_ns](const auto& answer, auto) { take_lease(answer, now_ns); };
  if (lease_ == 0) {
    if (!due_.empty() && !calls_->is_under_way(grant_))
      grant_ = calls_->start(
          {.request = etcd::grant(kKeptLease_s), .on_answer = calls_->reading(etcd::parse_grant, take)}, now_ns);
    return;
  }
  if (now_ns >= renewal_ns_ && !calls_->is_under_way(renewal_))
    renewal_ = calls_->start(
        {.request = etcd::keep_alive(lease_), .on_answer = calls_->reading(etcd::parse_keep_alive, take)}, now_ns);
  std::size_t left = kPutsPerPoll;
  for (auto next = due_.begin(); next != due_.end() && left > 0 && !calls_->is_full();) {
    const std::string& room = *next;
    Text& kept = texts_.at(room);
    const std::int64_t claim = claim_of(room);
    if (claim == 0 || kept.call != 0) {
      ++next;
      continue;
    }
    counters_->rooms_kept.add();
    const auto lose = [this, room](auto) {
      end_put(room, false);
      lose_lease();
    };
    kept.call = calls_->start(
        // The put names the claim: if the room has another owner by now, etcd does nothing.
        {.request = etcd::put_beside(keys_->of_room(room), claim, beside_release(room)),
         .on_answer = calls_->reading(etcd::parse_txn, [this, room](const auto&, auto) { end_put(room, true); }),
         .on_failure = [this, room](auto, auto) { end_put(room, false); },
         .on_lease_gone = lose},
        now_ns);
    next = due_.erase(next);
    --left;
  }
}

void EtcdKept::take_lease(const etcd::LeaseAnswer& answer, std::int64_t sent_ns) {
  if (answer.ttl_s == 0) return lose_lease();
  lease_ = answer.lease;
  renewal_ns_ = sent_ns + kKeptRenewal_ns;
}

void EtcdKept::lose_lease() {
  lease_ = 0;
  for (const auto& [room, kept] : texts_)
    if (!kept.text.empty()) due_.insert(room);
}

void EtcdKept::end_put(const std::string& room, bool is_done) {
  const auto found = texts_.find(room);
  if (found == texts_.end()) return;
  found->second.call = 0;
  // A write that etcd has refused, because the room has another claim by now, counts as done.
  if (!is_done) due_.insert(room);
}

}  // namespace hairnet::server
