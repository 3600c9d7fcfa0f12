#include "server/grooms/groom_store.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "server/grooms/level_bytes.hpp"
#include "server/telemetry/log_hash.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;
using wire::GroomState;

// The folder of the cache is listed this often: a groom that another server puts there is found within this time.
constexpr std::int64_t kRefreshInterval_ns = 10'000'000'000;

}  // namespace

GroomStore::GroomStore(const GroomStoreLimits& limits, GroomBuilder& builder, CommandQueue& commands,
                       GroomCounters& counters, GroomListener listener)
    : limits_(limits),
      builder_(&builder),
      commands_(&commands),
      counters_(&counters),
      listener_(std::move(listener)),
      files_(builder),
      uploads_(limits, shares_, counters),
      turns_(limits, shares_, builder, counters),
      learning_(limits.learning, counters) {
  HAIRNET_ASSERT(listener_.send);
  HAIRNET_ASSERT(limits.groom_bytes_max > 0);
  HAIRNET_ASSERT(limits.groom_count_max > 0);
}

// The sums are those of the entries, and every entry has what its state needs.
void GroomStore::check_invariants() const {
  HAIRNET_ASSERT(grooms_.size() <= limits_.groom_count_max);
#ifdef HAIRNET_VALIDATE_ON
  uploads_.check_invariants();
  std::size_t level_bytes = 0, queued = 0;
  for (const auto& [hash, entry] : grooms_) {
    level_bytes += entry.level_bytes;
    queued += entry.state == State::queued || entry.state == State::building ? 1 : 0;
    if (entry.state == State::building || entry.state == State::ready) HAIRNET_ASSERT(entry.bytes);
    if (entry.state == State::uploading) HAIRNET_ASSERT(!entry.bytes);
    HAIRNET_ASSERT((entry.state == State::ready) == (entry.level_bytes > 0));
    HAIRNET_ASSERT(uploads_.has_any(hash) == (entry.state == State::uploading));
    HAIRNET_ASSERT(entry.used <= uses_);
  }
  HAIRNET_ASSERT(level_bytes == level_bytes_);
  HAIRNET_ASSERT(queued == turns_.count());
#endif
}

Refused GroomStore::offer(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns) {
  counters_->grooms_offered.add();
  if (offer.byte_count == 0 || offer.byte_count > limits_.groom_bytes_max) {
    counters_->grooms_refused_size.add();
    return {ErrorReason::limit_exceeded,
            fmt::format("a groom of {} bytes; 1 to {} are taken", offer.byte_count, limits_.groom_bytes_max)};
  }
  auto groom = grooms_.find(offer.hash);
  if (Refused refused = check_retain(session, groom)) return refused;
  if (groom == grooms_.end() && builder_->is_cached(offer.hash)) {
    if (Refused refused = queue_cached(session, offer.hash, now_ns)) return refused;
    groom = grooms_.find(offer.hash);
  }
  if (groom != grooms_.end()) return offer_known(groom, session, offer, now_ns);
  if (Refused refused = make_place(session, now_ns)) return refused;
  groom = grooms_.try_emplace(offer.hash).first;
  groom->second.users[session].offered_bytes = offer.byte_count;
  groom->second.used = ++uses_;
  if (search(groom, now_ns)) return {};
  Refused refused = ask(groom, session, now_ns);
  if (refused) erase(groom);
  return refused;
}

Refused GroomStore::offer_known(Grooms::iterator groom, SessionId session, const wire::GroomOffer& offer,
                                std::int64_t now_ns) {
  HAIRNET_ASSERT(groom != grooms_.end());
  HAIRNET_ASSERT(offer.byte_count > 0);
  Entry& entry = groom->second;
  const std::optional<std::uint64_t> received = uploads_.received({offer.hash, session});
  const std::uint64_t known_bytes = received ? entry.users.at(session).offered_bytes : entry.byte_count;
  if (known_bytes != 0 && known_bytes != offer.byte_count) {
    counters_->grooms_refused_hash.add();
    return {ErrorReason::groom_hash_mismatch,
            fmt::format("the groom of that hash has {} bytes, not {}", known_bytes, offer.byte_count)};
  }
  const bool has_offered = std::exchange(entry.users[session].offered_bytes, offer.byte_count) != 0;
  entry.used = ++uses_;
  // GroomNeed follows when the object store has answered.
  if (entry.state == State::searched) return {};
  listener_.send(session, wire::GroomNeed{offer.hash, received.value_or(offer.byte_count)}, now_ns);
  if (received) return {};
  if (!has_offered) counters_->grooms_shared.add();
  listener_.send(session, wire::GroomStatus{offer.hash, state_of(entry)}, now_ns);
  return {};
}

wire::GroomState GroomStore::state_of(const Entry& entry) {
  return entry.state == State::ready      ? GroomState::ready
         : entry.state == State::building ? GroomState::building
                                          : GroomState::queued;
}

void GroomStore::resend_states(SessionId session, std::int64_t now_ns) {
  // No chunk could come while the session was detached, so the upload has not stalled.
  uploads_.restart_timeout(session, now_ns);
  for (auto& [hash, entry] : grooms_) {
    if (!entry.users.contains(session)) continue;
    if (const auto received = uploads_.received({hash, session})) {
      listener_.send(session, wire::GroomNeed{hash, *received}, now_ns);
    } else {
      listener_.send(session, wire::GroomStatus{hash, state_of(entry)}, now_ns);
    }
  }
}

GroomStore::Bytes GroomStore::bytes(const wire::GroomHash& hash) {
  if (const auto groom = grooms_.find(hash); groom != grooms_.end() && groom->second.bytes) {
    groom->second.used = ++uses_;
    return groom->second.bytes;
  }
  return files_.find(hash);
}

Refused GroomStore::check_retain(SessionId session, Grooms::const_iterator groom) {
  if (groom != grooms_.end() && groom->second.users.contains(session)) return {};
  const auto retained = std::ranges::count_if(grooms_, [&](const auto& g) { return g.second.users.contains(session); });
  if (static_cast<std::size_t>(retained) >= limits_.grooms_per_session_max) {
    counters_->grooms_refused_limit.add();
    return {ErrorReason::limit_exceeded, fmt::format("at most {} grooms a session", limits_.grooms_per_session_max)};
  }
  return groom == grooms_.end() ? Refused() : check_strands(session, groom);
}

Refused GroomStore::check_strands(SessionId session, Grooms::const_iterator groom) {
  Refused refused;
  const GroomShare share = shares_.share_of(session);
  if (strands_with({&session, 1}, groom) > limits_.strands_per_session_max)
    refused = {ErrorReason::limit_exceeded,
               fmt::format("at most {} strands in all grooms of the session", limits_.strands_per_session_max)};
  else if (share.strand_count_max != GroomShare{}.strand_count_max &&
           strands_with(shares_.sessions_of_holder(share.token_holder), groom) > share.strand_count_max)
    refused = {ErrorReason::limit_exceeded,
               fmt::format("at most {} strands in all grooms of the token", share.strand_count_max)};
  if (refused) counters_->grooms_refused_strands.add();
  return refused;
}

std::uint64_t GroomStore::strands_with(std::span<const SessionId> sessions, Grooms::const_iterator groom) const {
  HAIRNET_ASSERT(groom != grooms_.end());
  std::uint64_t strands = groom->second.strand_count;
  for (auto retained = grooms_.begin(); retained != grooms_.end(); ++retained) {
    const auto& users = retained->second.users;
    const bool is_used = std::ranges::any_of(sessions, [&users](SessionId id) { return users.contains(id); });
    if (retained != groom && is_used) strands += retained->second.strand_count;
  }
  return strands;
}

Refused GroomStore::retain(SessionId session, const wire::GroomHash& hash, std::int64_t now_ns) {
  const auto groom = grooms_.find(hash);
  if (groom == grooms_.end() && !builder_->is_cached(hash))
    return {ErrorReason::groom_unknown, "offer the groom first"};
  if (Refused refused = check_retain(session, groom)) return refused;
  if (groom == grooms_.end()) return queue_cached(session, hash, now_ns);
  groom->second.users.try_emplace(session);
  groom->second.used = ++uses_;
  return {};
}

std::vector<wire::GroomHash> GroomStore::in_use() const {
  std::vector<std::pair<std::size_t, wire::GroomHash>> used;
  for (const auto& [hash, entry] : grooms_)
    if (entry.state == State::ready && !entry.users.empty()) used.emplace_back(entry.users.size(), hash);
  std::ranges::stable_sort(used, std::greater(), [](const auto& one) { return one.first; });
  std::vector<wire::GroomHash> hashes;
  for (const auto& [count, hash] : used) hashes.push_back(hash);
  return hashes;
}

bool GroomStore::ready(const wire::GroomHash& hash) const {
  const auto groom = grooms_.find(hash);
  return groom != grooms_.end() && groom->second.state == State::ready;
}

std::size_t GroomStore::user_count() const {
  std::size_t count = 0;
  for (const auto& [hash, entry] : grooms_) count += entry.users.size();
  return count;
}

void GroomStore::release(SessionId session, std::int64_t now_ns) {
  files_.forget(session);
  for (auto groom = grooms_.begin(); groom != grooms_.end();) {
    const auto next = std::next(groom);
    Entry& entry = groom->second;
    const bool was_user = entry.users.erase(session) > 0;
    if (const UploadId id{groom->first, session}; uploads_.received(id)) {
      uploads_.end(id);
      go_on_without(groom, now_ns);
    } else if (was_user && entry.users.empty() && entry.state != State::ready) {
      erase(groom);
    }
    groom = next;
  }
  const Sharer sharer = shares_.sharer_of(session);
  shares_.close(session);
  uploads_.close(session);
  if (!shares_.has_any(sharer)) turns_.forget(sharer);
}

void GroomStore::poll(std::int64_t now_ns) {
  if (now_ns >= refresh_next_ns_) {
    refresh_next_ns_ = now_ns + kRefreshInterval_ns;
    builder_->refresh();
    if (objects_) objects_->wake();
  }
  GroomResult result;
  while (builder_->take(result)) {
    take(std::move(result), now_ns);
    // A built groom and its levels are new files, which the objects thread puts into the store.
    if (objects_) objects_->wake();
  }
  for (ObjectSync::Found found; objects_ && objects_->take(found);) take_found(found, now_ns);
  check_uploads(now_ns);
  turns_.poll(now_ns);
  queue_prepared(now_ns);
  learn(now_ns);
  files_.erase_expired();
  check_invariants();
  counters_->gauges.grooms.set(static_cast<double>(grooms_.size()));
  counters_->gauges.groom_upload_bytes.set(static_cast<double>(upload_bytes()));
  counters_->gauges.groom_level_bytes.set(static_cast<double>(level_bytes_));
  counters_->gauges.grooms_waiting.set(static_cast<double>(turns_.count()));
}

Refused GroomStore::make_place(SessionId session, std::int64_t now_ns) {
  while (grooms_.size() >= limits_.groom_count_max) {
    if (evict_one()) continue;
    const Refused refused{ErrorReason::limit_exceeded, "the server has its maximum number of grooms; try again"};
    counters_->grooms_refused_limit.add();
    const std::optional<UploadId> ended = uploads_.to_end_for(session, GroomUploads::Scarce::places, 1);
    if (!ended) return refused;
    refuse_upload(*ended, refused, now_ns);
  }
  return {};
}

Refused GroomStore::make_place_in_queue(SessionId session, std::int64_t now_ns) {
  if (!turns_.is_full()) return {};
  const Refused refused{ErrorReason::groom_build_queue_full, "too many grooms wait to be built; try again"};
  counters_->grooms_refused_queue_full.add();
  const std::optional<wire::GroomHash> dropped = turns_.to_drop_for(session);
  if (!dropped) return refused;
  const auto groom = grooms_.find(*dropped);
  const auto users = groom->second.users;
  for (const auto& [user, its] : users) refuse_user(groom, user, refused, now_ns);
  erase(groom);
  return {};
}

bool GroomStore::make_room(const UploadId& id, std::size_t bytes, std::int64_t now_ns) {
  while (upload_bytes() + bytes > limits_.upload_bytes_max) {
    const std::optional<UploadId> others = uploads_.to_end_for(id.session, GroomUploads::Scarce::bytes, bytes);
    counters_->grooms_refused_limit.add();
    refuse_upload(others.value_or(id), {ErrorReason::limit_exceeded, "too many bytes are being uploaded; try again"},
                  now_ns);
    if (!others) return false;
  }
  return true;
}

void GroomStore::free_memory(std::int64_t now_ns) {
  if (evict_one()) return;
  const std::optional<UploadId> largest = uploads_.largest();
  if (!largest) return;
  counters_->grooms_refused_limit.add();
  refuse_upload(*largest, {ErrorReason::limit_exceeded, "the server has no memory left; try again"}, now_ns);
}

bool GroomStore::evict_one() {
  auto oldest = grooms_.end();
  for (auto groom = grooms_.begin(); groom != grooms_.end(); ++groom) {
    if (groom->second.state != State::ready || !groom->second.users.empty()) continue;
    if (oldest == grooms_.end() || groom->second.used < oldest->second.used) oldest = groom;
  }
  if (oldest == grooms_.end()) return false;
  counters_->grooms_evicted.add();
  erase(oldest);
  return true;
}

// These functions bring a groom from its offer to its bytes.

bool GroomStore::search(Grooms::iterator groom, std::int64_t now_ns) {
  HAIRNET_ASSERT(!uploads_.has_any(groom->first));
  if (!objects_ || !objects_->find(groom->first)) return false;
  groom->second.state = State::searched;
  groom->second.asked_ns = now_ns;
  return true;
}

void GroomStore::take_found(const ObjectSync::Found& found, std::int64_t now_ns) {
  const auto groom = grooms_.find(found.groom);
  if (groom == grooms_.end() || groom->second.state != State::searched) return;
  if (!found.is_cached) return go_on_without(groom, now_ns);
  const auto& users = groom->second.users;
  queue(groom, users.empty() ? 0 : users.begin()->first, {}, now_ns);
  for (const auto& [session, user] : users) {
    if (user.offered_bytes == 0) continue;
    counters_->grooms_shared.add();
    listener_.send(session, wire::GroomNeed{groom->first, user.offered_bytes}, now_ns);
  }
  send_state(groom, GroomState::queued, now_ns);
}

Refused GroomStore::ask(Grooms::iterator groom, SessionId session, std::int64_t now_ns) {
  Entry& entry = groom->second;
  User& user = entry.users.at(session);
  shares_.open_alone(session);
  if (Refused refused = uploads_.begin({groom->first, session}, user.offered_bytes, now_ns)) return refused;
  user.was_asked = true;
  entry.state = State::uploading;
  entry.asked_ns = now_ns;
  listener_.send(session, wire::GroomNeed{groom->first, 0}, now_ns);
  return {};
}

bool GroomStore::ask_next(Grooms::iterator groom, std::int64_t now_ns) {
  const auto users = groom->second.users;
  for (const auto& [session, user] : users) {
    if (user.offered_bytes == 0 || uploads_.has_any_of_sharer({groom->first, session})) continue;
    const Refused refused = ask(groom, session, now_ns);
    if (!refused) return true;
    refuse_user(groom, session, refused, now_ns);
  }
  return false;
}

ChunkAnswer GroomStore::chunk(SessionId session, wire::GroomChunk chunk, std::int64_t now_ns) {
  const auto groom = grooms_.find(chunk.hash);
  if (groom == grooms_.end() || !groom->second.users.contains(session))
    return {{ErrorReason::groom_unknown, "a chunk of a groom that was not offered"}};
  const UploadId id{chunk.hash, session};
  const std::optional<std::uint64_t> received = uploads_.received(id);
  // These bytes are here already, or the session was asked for them before another session brought the whole file.
  const bool is_repeated = received ? chunk.offset < *received && chunk.bytes.size() <= *received - chunk.offset
                                    : groom->second.users.at(session).was_asked;
  if (is_repeated && !chunk.bytes.empty()) return {};
  if (Refused refused = uploads_.check(session, chunk)) return {std::move(refused)};
  if (!make_room(id, chunk.bytes.size(), now_ns) || !uploads_.put(session, std::move(chunk))) return {{}, true};
  Refused refused = finish_upload(groom, session, now_ns);
  const bool was_taken = !refused;
  return {std::move(refused), was_taken};
}

Refused GroomStore::finish_upload(Grooms::iterator groom, SessionId session, std::int64_t now_ns) {
  const UploadId id{groom->first, session};
  std::optional<GroomUploads::Chunks> chunks = uploads_.take(id);
  if (!chunks) {
    counters_->grooms_refused_hash.add();
    refuse_upload(id, {ErrorReason::groom_hash_mismatch, "the bytes do not have the offered hash"}, now_ns);
    return {};
  }
  counters_->grooms_uploaded.add();
  if (Refused refused = make_place_in_queue(session, now_ns)) {
    send_state(groom, GroomState::refused, now_ns);
    erase(groom);
    return refused;
  }
  groom->second.byte_count = groom->second.users.at(session).offered_bytes;
  queue(groom, session, *std::move(chunks), now_ns);
  refuse_other_sizes(groom, now_ns);
  send_state(groom, GroomState::queued, now_ns);
  return {};
}

void GroomStore::refuse_upload(const UploadId& id, const Refused& refused, std::int64_t now_ns) {
  const auto groom = grooms_.find(id.groom);
  uploads_.end(id);
  refuse_user(groom, id.session, refused, now_ns);
  go_on_without(groom, now_ns);
}

void GroomStore::go_on_without(Grooms::iterator groom, std::int64_t now_ns) {
  if (groom->second.users.empty()) return erase(groom);
  if (uploads_.has_any(groom->first) || ask_next(groom, now_ns)) return;
  if (groom->second.users.empty()) return erase(groom);
  counters_->grooms_refused_absent.add();
  refuse_all(groom, {ErrorReason::groom_unknown, "no connected session has the groom; offer it"}, now_ns);
}

// Uploads that are too slow end. A user who has waited for another's, or for the object store, for too long is asked
// for its own bytes.
void GroomStore::check_uploads(std::int64_t now_ns) {
  for (const SessionId session : uploads_.take_stalled(now_ns)) {
    for (const UploadId& id : uploads_.uploads_of(session)) {
      counters_->grooms_refused_stalled.add();
      refuse_upload(id, {ErrorReason::limit_exceeded, "the upload stalled"}, now_ns);
    }
  }
  for (auto groom = grooms_.begin(); groom != grooms_.end();) {
    const auto next = std::next(groom);
    const Entry& entry = groom->second;
    const bool is_late = now_ns - entry.asked_ns > limits_.upload_patience_ns;
    if (is_late && entry.state == State::uploading)
      ask_next(groom, now_ns);
    else if (is_late && entry.state == State::searched)
      go_on_without(groom, now_ns);
    groom = next;
  }
}

// These functions bring a groom from its bytes to its levels.

Refused GroomStore::queue_cached(SessionId session, const wire::GroomHash& hash, std::int64_t now_ns) {
  if (Refused refused = make_place(session, now_ns)) return refused;
  const auto [groom, is_new] = grooms_.try_emplace(hash);
  HAIRNET_ASSERT(is_new);
  groom->second.users.try_emplace(session);
  groom->second.used = ++uses_;
  queue(groom, session, {}, now_ns);
  return {};
}

void GroomStore::queue(Grooms::iterator groom, SessionId owner, GroomUploads::Chunks chunks, std::int64_t now_ns) {
  groom->second.state = State::queued;
  turns_.queue(groom->first, owner, std::move(chunks), now_ns);
}

void GroomStore::prepare(std::span<const wire::GroomHash> grooms, std::int64_t now_ns) {
  for (const wire::GroomHash& hash : grooms) {
    const bool waits = std::ranges::find(to_prepare_, hash) != to_prepare_.end();
    if (!waits && !grooms_.contains(hash) && to_prepare_.size() < limits_.groom_count_max) to_prepare_.push_back(hash);
  }
  queue_prepared(now_ns);
}

void GroomStore::queue_prepared(std::int64_t now_ns) {
  while (!to_prepare_.empty() && turns_.is_idle(now_ns)) {
    const wire::GroomHash hash = to_prepare_.front();
    to_prepare_.pop_front();
    if (grooms_.contains(hash)) continue;
    if (grooms_.size() >= limits_.groom_count_max && !evict_one()) continue;
    const auto groom = grooms_.try_emplace(hash).first;
    groom->second.used = ++uses_;
    if (!objects_ || builder_->is_cached(hash))
      // Without an object store the builder is asked although the file is not listed: a server that shares the folder
      // may have added the file since the last listing.
      queue(groom, 0, {}, now_ns);
    else if (!search(groom, now_ns))
      erase(groom);
  }
}

void GroomStore::take(GroomResult result, std::int64_t now_ns) {
  if (result.outcome == GroomResult::Outcome::read) {
    for (const SessionId session : files_.take(result.hash, result.bytes)) {
      if (listener_.deliver) listener_.deliver(session, result.hash, result.bytes, now_ns);
    }
    return;
  }
  const BuildTurns::Progress progress = turns_.take(result, now_ns);
  if (progress == BuildTurns::Progress::none) return;
  const auto groom = grooms_.find(result.hash);
  if (progress == BuildTurns::Progress::building) return take_building(groom, std::move(result), now_ns);
  if (progress == BuildTurns::Progress::queued) {
    groom->second.state = State::queued;
    return send_state(groom, GroomState::queued, now_ns);
  }
  if (result.outcome == GroomResult::Outcome::ready) return take_ready(groom, std::move(result), now_ns);
  // The cache has lost the file since it was listed, so a user is asked for the bytes.
  if (result.outcome == GroomResult::Outcome::absent) return go_on_without(groom, now_ns);
  refuse_all(groom, turns_.refusal_of(result), now_ns);
}

void GroomStore::take_building(Grooms::iterator groom, GroomResult result, std::int64_t now_ns) {
  Entry& entry = groom->second;
  HAIRNET_ASSERT(entry.state == State::queued);
  entry.state = State::building;
  entry.bytes = std::move(result.bytes);
  entry.byte_count = entry.bytes->size();
  entry.strand_count = result.strand_count;
  refuse_other_sizes(groom, now_ns);
  const auto users = entry.users;
  for (const auto& [session, user] : users) {
    if (const Refused refused = check_strands(session, groom)) {
      refuse_user(groom, session, refused, now_ns);
      if (listener_.revoke) listener_.revoke(session, groom->first, now_ns);
    }
  }
  send_state(groom, GroomState::building, now_ns);
}

void GroomStore::take_ready(Grooms::iterator groom, GroomResult result, std::int64_t now_ns) {
  Entry& entry = groom->second;
  HAIRNET_ASSERT(entry.state == State::building);
  HAIRNET_ASSERT(result.levels);
  std::size_t bytes = entry.bytes->size() + server::level_bytes(*result.levels);
  for (const Bytes& made : {result.basis, result.learnt}) bytes += made ? made->size() : 0;
  while (level_bytes_ + bytes > limits_.level_bytes_max && evict_one()) {
  }
  if (level_bytes_ + bytes > limits_.level_bytes_max) {
    counters_->grooms_refused_limit.add();
    return refuse_all(groom, {ErrorReason::limit_exceeded, "the server has no room for more levels"}, now_ns);
  }
  entry.state = State::ready;
  entry.levels = result.levels;
  entry.level_bytes = bytes;
  level_bytes_ += bytes;
  learning_.add(groom->first, result.levels->learnt != nullptr);
  counters_->grooms_ready.add();
  spdlog::info("event=groom_ready groom={} level_bytes={}", log_hash(groom->first), bytes);
  GroomReady ready{groom->first, std::move(result.levels), entry.bytes};
  if (result.basis) ready.basis = files_.add(result.basis);
  if (result.learnt) ready.learnt = files_.add(result.learnt);
  entry.basis = std::move(result.basis);
  entry.learnt = std::move(result.learnt);
  commands_->put(std::move(ready));
  send_state(groom, GroomState::ready, now_ns);
}

void GroomStore::learn(std::int64_t now_ns) {
  for (LearningResult result; learning_.take(result);) take_learnt(std::move(result));
  const auto user_count = [this](const wire::GroomHash& hash) { return grooms_.at(hash).users.size(); };
  const std::optional<wire::GroomHash> next = learning_.next(user_count, now_ns);
  if (!next) return;
  const Entry& entry = grooms_.at(*next);
  LearningJob job{*next, entry.levels.lock(), entry.bytes};
  if (job.levels && job.levels->modes) learning_.begin(std::move(job));
}

void GroomStore::take_learnt(LearningResult result) {
  Entry& entry = grooms_.at(result.groom);
  const std::size_t bytes = result.levels->learnt->bytes() + result.file->size();
  entry.level_bytes += bytes;
  level_bytes_ += bytes;
  entry.levels = result.levels;
  builder_->cache(result.groom, result.levels);
  commands_->put(GroomReady{result.groom, std::move(result.levels), nullptr, std::nullopt, files_.add(result.file)});
  entry.learnt = std::move(result.file);
  while (level_bytes_ > limits_.level_bytes_max && evict_one()) {
  }
}

void GroomStore::refuse_user(Grooms::iterator groom, SessionId session, const Refused& refused, std::int64_t now_ns) {
  groom->second.users.erase(session);
  listener_.send(session, wire::Error{refused.reason, 0, groom->first, refused.detail}, now_ns);
  listener_.send(session, wire::GroomStatus{groom->first, GroomState::refused}, now_ns);
}

void GroomStore::refuse_other_sizes(Grooms::iterator groom, std::int64_t now_ns) {
  const std::uint64_t byte_count = groom->second.byte_count;
  const auto users = groom->second.users;
  for (const auto& [session, user] : users) {
    if (user.offered_bytes == 0 || user.offered_bytes == byte_count) continue;
    counters_->grooms_refused_hash.add();
    refuse_user(groom, session,
                {ErrorReason::groom_hash_mismatch,
                 fmt::format("the groom of that hash has {} bytes, not {}", byte_count, user.offered_bytes)},
                now_ns);
  }
}

void GroomStore::refuse_all(Grooms::iterator groom, const Refused& refused, std::int64_t now_ns) {
  const auto users = groom->second.users;
  spdlog::info("event=groom_refused groom={} reason={} detail={}", log_hash(groom->first), to_string(refused.reason),
               log_text(refused.detail));
  for (const auto& [session, user] : users) refuse_user(groom, session, refused, now_ns);
  erase(groom);
}

void GroomStore::send_state(Grooms::const_iterator groom, GroomState state, std::int64_t now_ns) {
  for (const auto& [session, user] : groom->second.users)
    listener_.send(session, wire::GroomStatus{groom->first, state}, now_ns);
}

void GroomStore::erase(Grooms::iterator groom) {
  const Entry& entry = groom->second;
  uploads_.end_all(groom->first);
  turns_.erase(groom->first);
  learning_.erase(groom->first);
  HAIRNET_ASSERT(level_bytes_ >= entry.level_bytes);
  level_bytes_ -= entry.level_bytes;
  if (entry.state == State::ready) commands_->put(ForgetGroom{groom->first});
  grooms_.erase(groom);
}

}  // namespace hairnet::server
