#include "server/grooms/groom_store.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "server/grooms/level_bytes.hpp"
#include "server/telemetry/log_hash.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;
using wire::GroomState;

// The builder gets at most this many cached grooms at once, so that uploads do not wait long behind them.
constexpr std::size_t kReadingMax = 2;
// The longest time until a groom is found that another server has put into the cache's folder.
constexpr std::int64_t kRefreshInterval_ns = 10'000'000'000;

ErrorReason reason_of(GroomResult::Fault fault) {
  switch (fault) {
    case GroomResult::Fault::none:
      return ErrorReason::none;
    case GroomResult::Fault::hash:
      return ErrorReason::groom_hash_mismatch;
    case GroomResult::Fault::size:
    case GroomResult::Fault::time:
      return ErrorReason::limit_exceeded;
    case GroomResult::Fault::invalid:
    case GroomResult::Fault::stopping:
      break;
  }
  return ErrorReason::groom_invalid;
}

Counter& counter_of(GroomResult::Fault fault, GroomCounters& counters) {
  switch (fault) {
    case GroomResult::Fault::hash:
      return counters.grooms_refused_hash;
    case GroomResult::Fault::size:
      return counters.grooms_refused_size;
    case GroomResult::Fault::time:
      return counters.grooms_refused_build_time;
    case GroomResult::Fault::none:
    case GroomResult::Fault::invalid:
    case GroomResult::Fault::stopping:
      break;
  }
  return counters.grooms_refused_invalid;
}

}  // namespace

GroomStore::GroomStore(const GroomStoreLimits& limits, GroomBuilder& builder, CommandQueue& commands,
                       GroomCounters& counters, GroomListener listener)
    : limits_(limits), builder_(&builder), commands_(&commands), counters_(&counters), listener_(std::move(listener)) {
  HAIRNET_ASSERT(listener_.send);
  HAIRNET_ASSERT(limits.groom_bytes_max > 0);
  HAIRNET_ASSERT(limits.groom_count_max > 0);
}

// The sums are those of the entries, and every entry has what its state needs.
void GroomStore::check_invariants() const {
  HAIRNET_ASSERT(grooms_.size() <= limits_.groom_count_max);
  HAIRNET_ASSERT(reading_count_ <= kReadingMax);
#ifdef HAIRNET_VALIDATE_ON
  std::size_t upload_bytes = 0, level_bytes = 0, reading = 0;
  for (const auto& [hash, entry] : grooms_) {
    upload_bytes += entry.upload_bytes;
    level_bytes += entry.level_bytes;
    reading += entry.state == State::reading ? 1 : 0;
    HAIRNET_ASSERT(entry.received <= entry.byte_count || entry.state != State::uploading);
    HAIRNET_ASSERT((entry.state == State::building || entry.state == State::ready) == (entry.bytes != nullptr));
    HAIRNET_ASSERT((entry.state == State::ready) == (entry.level_bytes > 0));
    HAIRNET_ASSERT(entry.chunks.empty() || entry.state == State::uploading);
    HAIRNET_ASSERT(entry.used <= uses_);
    if (entry.state == State::uploading) HAIRNET_ASSERT(entry.users.contains(entry.uploader));
  }
  HAIRNET_ASSERT(upload_bytes == upload_bytes_);
  HAIRNET_ASSERT(level_bytes == level_bytes_);
  HAIRNET_ASSERT(reading == to_read_.size() + reading_count_);
#endif
}

void GroomStore::open(SessionId session, std::uint32_t bearer, std::uint64_t strand_count_max, std::int64_t now_ns) {
  Account& own = account(session, now_ns);
  own.bearer = bearer;
  own.strand_count_max = strand_count_max;
}

GroomStore::Account& GroomStore::account(SessionId session, std::int64_t now_ns) {
  const Account fresh{TokenBucket(limits_.upload_bytes_per_s, limits_.upload_burst_bytes, now_ns)};
  return accounts_.try_emplace(session, fresh).first->second;
}

Refused GroomStore::offer(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns) {
  counters_->grooms_offered.add();
  if (offer.byte_count == 0 || offer.byte_count > limits_.groom_bytes_max) {
    counters_->grooms_refused_size.add();
    return {ErrorReason::limit_exceeded,
            fmt::format("a groom of {} bytes; 1 to {} are taken", offer.byte_count, limits_.groom_bytes_max)};
  }
  const auto groom = grooms_.find(offer.hash);
  if (Refused refused = check_retain(session, groom)) return refused;
  if (groom != grooms_.end()) return offer_known(groom, session, offer, now_ns);
  if (!builder_->is_cached(offer.hash)) return begin_upload(session, offer, now_ns);
  if (Refused refused = begin_reading(session, offer.hash)) return refused;
  return offer_known(grooms_.find(offer.hash), session, offer, now_ns);
}

Refused GroomStore::offer_known(Grooms::iterator groom, SessionId session, const wire::GroomOffer& offer,
                                std::int64_t now_ns) {
  HAIRNET_ASSERT(groom != grooms_.end());
  HAIRNET_ASSERT(offer.byte_count > 0);
  Entry& entry = groom->second;
  // The first offer may state a wrong size; it is known only once the bytes have been checked against the hash.
  const bool is_known = entry.state == State::building || entry.state == State::ready;
  const bool uploads = entry.state == State::uploading && entry.uploader == session;
  if ((is_known || uploads) && entry.byte_count != offer.byte_count) {
    counters_->grooms_refused_hash.add();
    return {ErrorReason::groom_hash_mismatch,
            fmt::format("the groom of that hash has {} bytes, not {}", entry.byte_count, offer.byte_count)};
  }
  const bool offered = std::exchange(entry.users[session], offer.byte_count) != 0;
  entry.used = ++uses_;
  if (uploads) {
    send(session, wire::GroomNeed{offer.hash, entry.received}, now_ns);
    return {};
  }
  if (!offered) counters_->grooms_shared.add();
  send(session, wire::GroomNeed{offer.hash, offer.byte_count}, now_ns);
  send(session, wire::GroomStatus{offer.hash, state_of(entry)}, now_ns);
  return {};
}

wire::GroomState GroomStore::state_of(const Entry& entry) {
  return entry.state == State::ready      ? GroomState::ready
         : entry.state == State::building ? GroomState::building
                                          : GroomState::queued;
}

void GroomStore::resend_states(SessionId session, std::int64_t now_ns) {
  for (auto& [hash, entry] : grooms_) {
    if (!entry.users.contains(session)) continue;
    if (entry.state == State::uploading && entry.uploader == session) {
      entry.asked_ns = now_ns;  // no chunk could come while the session was detached
      send(session, wire::GroomNeed{hash, entry.received}, now_ns);
    } else {
      send(session, wire::GroomStatus{hash, state_of(entry)}, now_ns);
    }
  }
}

GroomStore::Bytes GroomStore::bytes(const wire::GroomHash& hash) {
  if (const auto groom = grooms_.find(hash); groom != grooms_.end() && groom->second.bytes) {
    groom->second.used = ++uses_;
    return groom->second.bytes;
  }
  const auto read = read_.find(hash);
  return read == read_.end() ? nullptr : read->second.lock();
}

bool GroomStore::fetch(SessionId session, const wire::GroomHash& hash) {
  if (!builder_->is_cached(hash)) return false;
  const auto [fetched, is_new] = fetches_.try_emplace(hash);
  if (is_new) builder_->read(hash);
  std::vector<SessionId>& waiting = fetched->second;
  if (std::ranges::find(waiting, session) == waiting.end()) waiting.push_back(session);
  return true;
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
  if (strands_with({&session, 1}, groom) > limits_.strands_per_session_max)
    refused = {ErrorReason::limit_exceeded,
               fmt::format("at most {} strands in all grooms of the session", limits_.strands_per_session_max)};
  const auto own = accounts_.find(session);
  if (!refused && own != accounts_.end() && own->second.strand_count_max != kNoStrandsMax) {
    std::vector<SessionId> sessions;
    for (const auto& [id, account] : accounts_) {
      if (account.bearer == own->second.bearer) sessions.push_back(id);
    }
    if (strands_with(sessions, groom) > own->second.strand_count_max)
      refused = {ErrorReason::limit_exceeded,
                 fmt::format("at most {} strands in all grooms of the token", own->second.strand_count_max)};
  }
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

Refused GroomStore::make_place() {
  while (grooms_.size() >= limits_.groom_count_max) {
    if (evict_one()) continue;
    counters_->grooms_refused_limit.add();
    return {ErrorReason::limit_exceeded, "the server has its maximum number of grooms"};
  }
  return {};
}

Refused GroomStore::check_upload(SessionId session, std::uint64_t byte_count, std::int64_t now_ns) {
  if (upload_bytes_ + byte_count > limits_.upload_bytes_max) {
    counters_->grooms_refused_limit.add();
    return {ErrorReason::limit_exceeded, "too many bytes are being uploaded; try again"};
  }
  if (account(session, now_ns).bytes.take(static_cast<double>(byte_count), now_ns)) return {};
  counters_->grooms_refused_rate.add();
  return {ErrorReason::limit_exceeded,
          fmt::format("more than {:.0f} bytes of grooms a second; try again later", limits_.upload_bytes_per_s)};
}

Refused GroomStore::begin_upload(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns) {
  if (Refused refused = make_place()) return refused;
  if (Refused refused = check_upload(session, offer.byte_count, now_ns)) return refused;
  HAIRNET_ASSERT(!grooms_.contains(offer.hash));
  Entry& entry = grooms_[offer.hash];
  entry.users[session] = offer.byte_count;
  entry.used = ++uses_;
  await_upload(grooms_.find(offer.hash), session, now_ns);
  return {};
}

void GroomStore::await_upload(Grooms::iterator groom, SessionId uploader, std::int64_t now_ns) {
  Entry& entry = groom->second;
  HAIRNET_ASSERT(entry.users.contains(uploader));
  HAIRNET_ASSERT(entry.users.at(uploader) > 0);  // it has offered the groom
  if (entry.byte_count != entry.users.at(uploader)) {
    entry.byte_count = entry.users.at(uploader);
    entry.received = 0;
    entry.chunks.clear();
  }
  entry.is_mixed = entry.received > 0 && (entry.is_mixed || entry.uploader != uploader);
  entry.is_asked_again = false;
  entry.state = State::uploading;
  entry.uploader = uploader;
  entry.asked_ns = now_ns;
  set_upload_bytes(entry, entry.byte_count);
  send(uploader, wire::GroomNeed{groom->first, entry.received}, now_ns);
}

Refused GroomStore::begin_reading(SessionId session, const wire::GroomHash& hash) {
  if (Refused refused = make_place()) return refused;
  HAIRNET_ASSERT(!grooms_.contains(hash));
  Entry& entry = grooms_[hash];
  entry.state = State::reading;
  entry.users[session] = 0;
  entry.used = ++uses_;
  to_read_.push_back(hash);
  feed_builder();
  return {};
}

void GroomStore::feed_builder() {
  while (!to_read_.empty() && reading_count_ < kReadingMax) {
    const auto groom = grooms_.find(to_read_.front());
    HAIRNET_ASSERT(groom != grooms_.end());
    HAIRNET_ASSERT(groom->second.state == State::reading);
    if (groom->second.users.empty()) {  // they have left
      erase(groom);
    } else {
      GroomJob job{groom->first, {}};
      if (!builder_->try_put(job)) return;
      ++reading_count_;
    }
    to_read_.pop_front();
  }
}

ChunkAnswer GroomStore::chunk(SessionId session, wire::GroomChunk chunk, std::int64_t now_ns) {
  const auto groom = grooms_.find(chunk.hash);
  if (groom == grooms_.end() || !groom->second.users.contains(session))
    return {{ErrorReason::groom_unknown, "a chunk of a groom that was not offered"}};
  if (is_repeated(groom->second, session, chunk)) return {};
  Refused refused = put_chunk(groom, session, std::move(chunk), now_ns);
  const bool was_taken = !refused;
  return {std::move(refused), was_taken};
}

bool GroomStore::is_repeated(const Entry& entry, SessionId session, const wire::GroomChunk& chunk) {
  if (chunk.bytes.empty() || entry.uploader != session) return false;
  if (entry.state == State::uploading && entry.is_asked_again && chunk.offset > entry.received) return true;
  const std::uint64_t there = entry.state == State::uploading ? entry.received : entry.byte_count;
  return chunk.offset < there && chunk.bytes.size() <= there - chunk.offset;
}

Refused GroomStore::put_chunk(Grooms::iterator groom, SessionId session, wire::GroomChunk chunk, std::int64_t now_ns) {
  Entry& entry = groom->second;
  if (entry.state != State::uploading || entry.uploader != session)
    return {ErrorReason::unexpected_message, "a chunk that was not asked for"};
  if (chunk.bytes.empty() || chunk.bytes.size() > wire::kGroomChunkBytesMax)
    return {ErrorReason::limit_exceeded, fmt::format("a chunk of {} bytes", chunk.bytes.size())};
  if (chunk.offset != entry.received)
    return {ErrorReason::unexpected_message,
            fmt::format("a chunk at {}, where {} was expected", chunk.offset, entry.received)};
  if (chunk.bytes.size() > entry.byte_count - entry.received)
    return {ErrorReason::limit_exceeded, fmt::format("more than the {} bytes offered", entry.byte_count)};
  entry.received += chunk.bytes.size();
  HAIRNET_ASSERT(entry.received <= entry.byte_count);
  account(session, now_ns).chunk_ns = now_ns;
  counters_->groom_bytes_received.add(chunk.bytes.size());
  chunk.bytes.shrink_to_fit();
  entry.chunks.push_back(std::move(chunk.bytes));
  return entry.received == entry.byte_count ? finish_upload(groom, now_ns) : Refused{};
}

Refused GroomStore::finish_upload(Grooms::iterator groom, std::int64_t now_ns) {
  HAIRNET_ASSERT(groom->second.received == groom->second.byte_count);
  HAIRNET_ASSERT(!groom->second.chunks.empty());  // without chunks the builder would read the cache
  counters_->grooms_uploaded.add();
  GroomJob job{groom->first, std::move(groom->second.chunks)};
  if (!builder_->try_put(job)) {
    counters_->grooms_refused_queue_full.add();
    send_state(groom, GroomState::refused, now_ns);
    erase(groom);
    return {ErrorReason::groom_build_queue_full, "too many grooms wait to be built; try again"};
  }
  groom->second.chunks.clear();
  groom->second.state = State::queued;
  send_state(groom, GroomState::queued, now_ns);
  return {};
}

Refused GroomStore::retain(SessionId session, const wire::GroomHash& hash) {
  const auto groom = grooms_.find(hash);
  if (groom == grooms_.end() && !builder_->is_cached(hash))
    return {ErrorReason::groom_unknown, "offer the groom first"};
  if (Refused refused = check_retain(session, groom)) return refused;
  if (groom == grooms_.end()) return begin_reading(session, hash);
  groom->second.users.try_emplace(session, 0);
  groom->second.used = ++uses_;
  return {};
}

bool GroomStore::ready(const wire::GroomHash& hash) const {
  const auto groom = grooms_.find(hash);
  return groom != grooms_.end() && groom->second.state == State::ready;
}

void GroomStore::release(SessionId session, std::int64_t now_ns) {
  accounts_.erase(session);
  for (auto& [hash, waiting] : fetches_) std::erase(waiting, session);
  for (auto groom = grooms_.begin(); groom != grooms_.end();) {
    const auto next = std::next(groom);
    Entry& entry = groom->second;
    entry.users.erase(session);
    if (entry.state == State::uploading && entry.uploader == session) pass_on(groom, now_ns);
    groom = next;
  }
}

void GroomStore::pass_on(Grooms::iterator groom, std::int64_t now_ns) {
  Entry& entry = groom->second;
  if (entry.users.empty()) return erase(groom);
  set_upload_bytes(entry, 0);
  const auto users = entry.users;
  for (const auto& [session, byte_count] : users) {
    if (byte_count == 0) continue;
    const Refused refused = check_upload(session, byte_count, now_ns);
    if (!refused) return await_upload(groom, session, now_ns);
    refuse_user(groom, session, refused, now_ns);
  }
  if (entry.users.empty()) return erase(groom);
  refuse_all(groom, {ErrorReason::groom_unknown, "no connected session has the groom; offer it"},
             counters_->grooms_refused_absent, now_ns);
}

bool GroomStore::has_stalled(const Entry& entry, std::int64_t now_ns) {
  const std::int64_t heard_ns = std::max(entry.asked_ns, account(entry.uploader, now_ns).chunk_ns);
  return now_ns - heard_ns > limits_.upload_timeout_ns;
}

void GroomStore::poll(std::int64_t now_ns) {
  if (now_ns >= refresh_next_ns_) {
    refresh_next_ns_ = now_ns + kRefreshInterval_ns;
    builder_->refresh();
  }
  GroomResult result;
  while (builder_->take(result)) take(std::move(result), now_ns);
  feed_builder();
  for (auto groom = grooms_.begin(); groom != grooms_.end();) {
    const auto next = std::next(groom);
    Entry& entry = groom->second;
    if (entry.state == State::uploading && has_stalled(entry, now_ns)) {
      counters_->grooms_refused_stalled.add();
      refuse_user(groom, entry.uploader, {ErrorReason::limit_exceeded, "the upload stalled"}, now_ns);
      pass_on(groom, now_ns);
    }
    groom = next;
  }
  std::erase_if(read_, [](const auto& read) { return read.second.expired(); });
  check_invariants();
  counters_->gauges.grooms.set(static_cast<double>(grooms_.size()));
  counters_->gauges.groom_upload_bytes.set(static_cast<double>(upload_bytes_));
  counters_->gauges.groom_level_bytes.set(static_cast<double>(level_bytes_));
  counters_->gauges.grooms_waiting.set(
      static_cast<double>(std::count_if(grooms_.begin(), grooms_.end(), [](const auto& g) {
        return g.second.state == State::queued || g.second.state == State::building;
      })));
}

void GroomStore::take(GroomResult result, std::int64_t now_ns) {
  if (result.outcome == GroomResult::Outcome::read) return hand_over(result, now_ns);
  const auto groom = grooms_.find(result.hash);
  if (groom == grooms_.end()) return;
  if (groom->second.state == State::reading) {
    HAIRNET_ASSERT(reading_count_ > 0);
    --reading_count_;
  }
  switch (result.outcome) {
    case GroomResult::Outcome::building:
      return take_building(groom, std::move(result), now_ns);
    case GroomResult::Outcome::ready:
      return take_ready(groom, std::move(result), now_ns);
    case GroomResult::Outcome::refused:
      return take_refused(groom, result, now_ns);
    case GroomResult::Outcome::absent:
      return pass_on(groom, now_ns);  // the cache lost it: ask a session that has offered it for the upload
    case GroomResult::Outcome::read:
      break;
  }
}

void GroomStore::hand_over(const GroomResult& read, std::int64_t now_ns) {
  const auto fetched = fetches_.extract(read.hash);
  if (read.bytes) read_[read.hash] = read.bytes;
  if (fetched.empty() || !listener_.deliver) return;
  for (const SessionId session : fetched.mapped()) listener_.deliver(session, read.hash, read.bytes, now_ns);
}

void GroomStore::take_building(Grooms::iterator groom, GroomResult result, std::int64_t now_ns) {
  Entry& entry = groom->second;
  HAIRNET_ASSERT(entry.state == State::queued || entry.state == State::reading);
  HAIRNET_ASSERT(result.bytes);
  entry.state = State::building;
  entry.bytes = std::move(result.bytes);
  entry.strand_count = result.strand_count;
  set_upload_bytes(entry, entry.bytes->size());
  entry.byte_count = entry.bytes->size();
  const auto users = entry.users;
  for (const auto& [session, offered_bytes] : users) {
    if (offered_bytes != 0 && offered_bytes != entry.byte_count) {
      counters_->grooms_refused_hash.add();
      refuse_user(groom, session,
                  {ErrorReason::groom_hash_mismatch,
                   fmt::format("the groom of that hash has {} bytes, not {}", entry.byte_count, offered_bytes)},
                  now_ns);
    } else if (const Refused refused = check_strands(session, groom)) {
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
  const std::size_t bytes = entry.bytes->size() + server::level_bytes(*result.levels);
  while (level_bytes_ + bytes > limits_.level_bytes_max && evict_one()) {
  }
  if (level_bytes_ + bytes > limits_.level_bytes_max)
    return refuse_all(groom, {ErrorReason::limit_exceeded, "the server has no room for more levels"},
                      counters_->grooms_refused_limit, now_ns);
  entry.state = State::ready;
  entry.level_bytes = bytes;
  level_bytes_ += bytes;
  set_upload_bytes(entry, 0);
  counters_->grooms_ready.add();
  spdlog::info("event=groom_ready groom={} level_bytes={}", log_hash(groom->first), bytes);
  commands_->put(GroomReady{groom->first, std::move(result.levels), entry.bytes});
  send_state(groom, GroomState::ready, now_ns);
}

void GroomStore::take_refused(Grooms::iterator groom, const GroomResult& result, std::int64_t now_ns) {
  const Refused refused{reason_of(result.fault), result.detail};
  Counter& counter = counter_of(result.fault, *counters_);
  if (result.fault != GroomResult::Fault::hash) return refuse_all(groom, refused, counter, now_ns);
  // One wrong uploader must not spoil the groom for the others.
  Entry& entry = groom->second;
  const bool is_there = entry.users.contains(entry.uploader);
  entry.received = 0;
  // The bytes came from several uploaders: ask the last one for all of them before it is refused.
  if (entry.is_mixed && is_there) {
    await_upload(groom, entry.uploader, now_ns);
    entry.is_asked_again = true;
    return;
  }
  counter.add();
  if (is_there) refuse_user(groom, entry.uploader, refused, now_ns);
  pass_on(groom, now_ns);
}

void GroomStore::refuse_user(Grooms::iterator groom, SessionId session, const Refused& refused, std::int64_t now_ns) {
  groom->second.users.erase(session);
  send(session, wire::Error{refused.reason, 0, groom->first, refused.detail}, now_ns);
  send(session, wire::GroomStatus{groom->first, GroomState::refused}, now_ns);
}

void GroomStore::refuse_all(Grooms::iterator groom, const Refused& refused, Counter& counter, std::int64_t now_ns) {
  const auto users = groom->second.users;
  spdlog::info("event=groom_refused groom={} reason={} detail={}", log_hash(groom->first), to_string(refused.reason),
               log_text(refused.detail));
  counter.add();
  for (const auto& [session, byte_count] : users) refuse_user(groom, session, refused, now_ns);
  erase(groom);
}

void GroomStore::send(SessionId session, const wire::Message& message, std::int64_t now_ns) {
  listener_.send(session, message, now_ns);
}

void GroomStore::send_state(Grooms::const_iterator groom, GroomState state, std::int64_t now_ns) {
  for (const auto& [session, byte_count] : groom->second.users)
    send(session, wire::GroomStatus{groom->first, state}, now_ns);
}

void GroomStore::set_upload_bytes(Entry& entry, std::size_t bytes) {
  HAIRNET_ASSERT(upload_bytes_ >= entry.upload_bytes);
  upload_bytes_ += bytes - entry.upload_bytes;
  entry.upload_bytes = bytes;
}

void GroomStore::erase(Grooms::iterator groom) {
  Entry& entry = groom->second;
  set_upload_bytes(entry, 0);
  HAIRNET_ASSERT(level_bytes_ >= entry.level_bytes);
  level_bytes_ -= entry.level_bytes;
  if (entry.state == State::ready) commands_->put(ForgetGroom{groom->first});
  grooms_.erase(groom);
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

std::size_t GroomStore::user_count() const {
  std::size_t count = 0;
  for (const auto& [hash, entry] : grooms_) count += entry.users.size();
  return count;
}

}  // namespace hairnet::server
