#include "server/grooms/groom_store.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <tuple>
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

// The longest time until a groom is found that another server has put into the cache's folder.
constexpr std::int64_t kRefreshInterval_ns = 10'000'000'000;
// Characters are raised within a second or two; a shortage that lasts is one.
constexpr std::int64_t kShortFor_ns = 5'000'000'000;

ErrorReason reason_of(BuildFault fault) {
  switch (fault) {
    case BuildFault::none:
      return ErrorReason::none;
    case BuildFault::size:
    case BuildFault::time:
    case BuildFault::memory:
      return ErrorReason::limit_exceeded;
    case BuildFault::invalid:
      return ErrorReason::groom_invalid;
    case BuildFault::crash:
    case BuildFault::server:
    case BuildFault::dropped:
      break;
  }
  return ErrorReason::groom_build_failed;
}

Refused refusal_of(const GroomResult& result) {
  const ErrorReason reason = reason_of(result.fault);
  if (reason != ErrorReason::groom_build_failed) return {reason, result.detail};
  return {reason, fmt::format("the server could not build it, by a fault of its own: {}; offer it again in a while",
                              result.detail)};
}

Counter& counter_of(BuildFault fault, GroomCounters& counters) {
  switch (fault) {
    case BuildFault::size:
      return counters.grooms_refused_size;
    case BuildFault::time:
      return counters.grooms_refused_build_time;
    case BuildFault::memory:
      return counters.grooms_refused_build_memory;
    case BuildFault::crash:
      return counters.grooms_refused_build_crash;
    case BuildFault::server:
      return counters.grooms_refused_server;
    case BuildFault::none:
    case BuildFault::invalid:
    case BuildFault::dropped:
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
#ifdef HAIRNET_VALIDATE_ON
  std::size_t upload_bytes = 0, level_bytes = 0, at_builder = 0;
  std::map<SessionId, std::size_t> upload_counts;
  for (const auto& [hash, entry] : grooms_) {
    upload_bytes += entry.upload_bytes;
    level_bytes += entry.level_bytes;
    at_builder += entry.job == 0 ? 0 : 1;
    if (entry.state == State::building || entry.state == State::ready) HAIRNET_ASSERT(entry.bytes);
    if (entry.state == State::uploading) HAIRNET_ASSERT(!entry.bytes);
    HAIRNET_ASSERT((entry.state == State::ready) == (entry.level_bytes > 0));
    HAIRNET_ASSERT(entry.uploads.empty() == (entry.state != State::uploading));
    HAIRNET_ASSERT(entry.chunks.empty() || entry.state == State::queued);
    HAIRNET_ASSERT(entry.used <= uses_);
    std::size_t received = 0;
    for (const auto& [session, upload] : entry.uploads) {
      HAIRNET_ASSERT(entry.users.contains(session));
      HAIRNET_ASSERT(upload.received < entry.users.at(session).offered_bytes);
      received += upload.received;
      ++upload_counts[session];
    }
    HAIRNET_ASSERT(entry.state != State::uploading || received == entry.upload_bytes);
  }
  HAIRNET_ASSERT(upload_bytes == upload_bytes_);
  HAIRNET_ASSERT(level_bytes == level_bytes_);
  HAIRNET_ASSERT(at_builder <= (is_builder_busy_ ? 1 : 0));
  for (const auto& [session, account] : accounts_)
    HAIRNET_ASSERT(account.upload_count == (upload_counts.contains(session) ? upload_counts[session] : 0));
#endif
}

void GroomStore::learn_with(HairLearner& learner, std::function<bool()> is_short) {
  HAIRNET_ASSERT(is_short);
  learner_ = &learner;
  is_short_ = std::move(is_short);
}

void GroomStore::open(SessionId session, const GroomShare& share, std::int64_t now_ns) {
  account(session, now_ns).share = share;
}

GroomStore::Sharer GroomStore::sharer_of(SessionId session) const {
  const auto own = accounts_.find(session);
  const std::uint32_t subject = own == accounts_.end() ? 0 : own->second.share.subject;
  return {subject, subject == 0 ? session : 0};
}

GroomStore::Account& GroomStore::account(SessionId session, std::int64_t now_ns) {
  const Account fresh{.bytes = TokenBucket(limits_.upload_bytes_per_s, limits_.upload_burst_bytes, now_ns),
                      .since_ns = now_ns};
  return accounts_.try_emplace(session, fresh).first->second;
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
  if (groom != grooms_.end()) return offer_known(groom, session, offer, now_ns);
  if (builder_->is_cached(offer.hash)) {
    if (Refused refused = queue_cached(session, offer.hash, now_ns)) return refused;
    return offer_known(grooms_.find(offer.hash), session, offer, now_ns);
  }
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
  const auto upload = entry.uploads.find(session);
  const std::uint64_t known_bytes =
      upload == entry.uploads.end() ? entry.byte_count : entry.users.at(session).offered_bytes;
  if (known_bytes != 0 && known_bytes != offer.byte_count) {
    counters_->grooms_refused_hash.add();
    return {ErrorReason::groom_hash_mismatch,
            fmt::format("the groom of that hash has {} bytes, not {}", known_bytes, offer.byte_count)};
  }
  const bool has_offered = std::exchange(entry.users[session].offered_bytes, offer.byte_count) != 0;
  entry.used = ++uses_;
  if (entry.state == State::searched) return {};  // the answer follows
  if (upload != entry.uploads.end()) {
    send(session, wire::GroomNeed{offer.hash, upload->second.received}, now_ns);
    return {};
  }
  if (!has_offered) counters_->grooms_shared.add();
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
  Account& own = account(session, now_ns);
  own.since_ns = now_ns;  // no chunk could come while the session was detached
  own.received = 0;
  for (auto& [hash, entry] : grooms_) {
    if (!entry.users.contains(session)) continue;
    if (const auto upload = entry.uploads.find(session); upload != entry.uploads.end()) {
      send(session, wire::GroomNeed{hash, upload->second.received}, now_ns);
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
  if (const auto made = made_.find(hash); made != made_.end()) return made->second.lock();
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
  if (!refused && own != accounts_.end() && own->second.share.strand_count_max != GroomShare{}.strand_count_max) {
    std::vector<SessionId> sessions;
    for (const auto& [id, account] : accounts_) {
      if (account.share.bearer == own->second.share.bearer) sessions.push_back(id);
    }
    if (strands_with(sessions, groom) > own->second.share.strand_count_max)
      refused = {ErrorReason::limit_exceeded,
                 fmt::format("at most {} strands in all grooms of the token", own->second.share.strand_count_max)};
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

Refused GroomStore::queue_cached(SessionId session, const wire::GroomHash& hash, std::int64_t now_ns) {
  if (Refused refused = make_place(session, now_ns)) return refused;
  HAIRNET_ASSERT(!grooms_.contains(hash));
  Entry& entry = grooms_[hash];
  entry.users.try_emplace(session);
  entry.used = ++uses_;
  queue(entry, session);
  feed_builder();
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

bool GroomStore::ready(const wire::GroomHash& hash) const {
  const auto groom = grooms_.find(hash);
  return groom != grooms_.end() && groom->second.state == State::ready;
}

void GroomStore::release(SessionId session, std::int64_t now_ns) {
  for (auto& [hash, waiting] : fetches_) std::erase(waiting, session);
  for (auto groom = grooms_.begin(); groom != grooms_.end();) {
    const auto next = std::next(groom);
    Entry& entry = groom->second;
    const bool was_user = entry.users.erase(session) > 0;
    if (entry.uploads.contains(session)) {
      end_upload(groom, session);
      go_on_without(groom, now_ns);
    } else if (was_user && entry.users.empty() && entry.state != State::ready) {
      erase(groom);
    }
    groom = next;
  }
  const Sharer sharer = sharer_of(session);
  accounts_.erase(session);
  if (std::ranges::none_of(accounts_, [&](const auto& a) { return sharer_of(a.first) == sharer; }))
    build_ns_.erase(sharer);
}

void GroomStore::poll(std::int64_t now_ns) {
  now_ns_ = now_ns;
  if (now_ns >= refresh_next_ns_) {
    refresh_next_ns_ = now_ns + kRefreshInterval_ns;
    builder_->refresh();
    if (objects_) objects_->wake();
  }
  GroomResult result;
  while (builder_->take(result)) {
    take(std::move(result), now_ns);
    if (objects_) objects_->wake();  // what was built is put there
  }
  for (ObjectSync::Found found; objects_ && objects_->take(found);) take_found(found, now_ns);
  check_uploads(now_ns);
  end_turn(now_ns);
  feed_builder();
  queue_prepared(now_ns);
  learn(now_ns);
  std::erase_if(read_, [](const auto& read) { return read.second.expired(); });
  std::erase_if(made_, [](const auto& made) { return made.second.expired(); });
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
  if (result.outcome != GroomResult::Outcome::building) is_builder_busy_ = false;
  const auto groom = grooms_.find(result.hash);
  // A dropped groom may have been offered again.
  if (groom == grooms_.end() || groom->second.job != result.job) return;
  Entry& entry = groom->second;
  if (result.outcome == GroomResult::Outcome::building) return take_building(groom, std::move(result), now_ns);
  entry.job = 0;
  charge(entry, result.build_ns);
  entry.charged_ns = 0;
  if (std::exchange(entry.gives_way, false) && result.fault == BuildFault::dropped) {
    counters_->builds_interrupted.add();
    entry.state = State::queued;
    entry.turn_ns *= 2;
    return send_state(groom, GroomState::queued, now_ns);
  }
  if (result.outcome == GroomResult::Outcome::ready) return take_ready(groom, std::move(result), now_ns);
  if (result.fault == BuildFault::server && build_again(groom, result, now_ns)) return;
  if (result.outcome == GroomResult::Outcome::refused)
    return refuse_all(groom, refusal_of(result), counter_of(result.fault, *counters_), now_ns);
  HAIRNET_ASSERT(result.outcome == GroomResult::Outcome::absent);
  go_on_without(groom, now_ns);  // the cache has lost it
}

bool GroomStore::build_again(Grooms::iterator groom, const GroomResult& result, std::int64_t now_ns) {
  Entry& entry = groom->second;
  counters_->builds_failed.add();
  const std::int64_t after_ns = limits_.build_again_ns << entry.build_count;
  const bool may_try = ++entry.build_count < limits_.build_count_max && entry.bytes;
  spdlog::warn("event=build_failed groom={} detail={} tries={} again={}", log_hash(groom->first),
               log_text(result.detail), entry.build_count, may_try);
  if (!may_try) return false;
  entry.state = State::queued;
  entry.build_again_ns = now_ns + after_ns;
  send_state(groom, GroomState::queued, now_ns);
  return true;
}

void GroomStore::hand_over(const GroomResult& read, std::int64_t now_ns) {
  const auto fetched = fetches_.extract(read.hash);
  if (read.bytes) read_[read.hash] = read.bytes;
  if (fetched.empty() || !listener_.deliver) return;
  for (const SessionId session : fetched.mapped()) listener_.deliver(session, read.hash, read.bytes, now_ns);
}

void GroomStore::take_building(Grooms::iterator groom, GroomResult result, std::int64_t now_ns) {
  Entry& entry = groom->second;
  HAIRNET_ASSERT(entry.state == State::queued);
  HAIRNET_ASSERT(result.bytes);
  entry.state = State::building;
  entry.built_since_ns = now_ns;
  if (entry.turn_ns == 0) entry.turn_ns = limits_.build_turn_ns;
  entry.bytes = std::move(result.bytes);
  entry.strand_count = result.strand_count;
  set_upload_bytes(entry, entry.bytes->size());
  entry.byte_count = entry.bytes->size();
  const auto users = entry.users;
  for (const auto& [session, user] : users) {
    if (user.offered_bytes != 0 && user.offered_bytes != entry.byte_count) {
      refuse_other_size(groom, session, now_ns);
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
  std::size_t bytes = entry.bytes->size() + server::level_bytes(*result.levels);
  for (const Bytes& made : {result.basis, result.learnt}) bytes += made ? made->size() : 0;
  while (level_bytes_ + bytes > limits_.level_bytes_max && evict_one()) {
  }
  if (level_bytes_ + bytes > limits_.level_bytes_max)
    return refuse_all(groom, {ErrorReason::limit_exceeded, "the server has no room for more levels"},
                      counters_->grooms_refused_limit, now_ns);
  entry.state = State::ready;
  entry.levels = result.levels;
  entry.was_learnt = result.levels->learnt != nullptr;
  entry.level_bytes = bytes;
  level_bytes_ += bytes;
  set_upload_bytes(entry, 0);
  counters_->grooms_ready.add();
  spdlog::info("event=groom_ready groom={} level_bytes={}", log_hash(groom->first), bytes);
  GroomReady ready{groom->first, std::move(result.levels), entry.bytes};
  if (result.basis) ready.basis = offer_made(result.basis);
  if (result.learnt) ready.learnt = offer_made(result.learnt);
  entry.basis = std::move(result.basis);
  entry.learnt = std::move(result.learnt);
  commands_->put(std::move(ready));
  send_state(groom, GroomState::ready, now_ns);
}

wire::GroomHash GroomStore::offer_made(const Bytes& file) {
  const wire::GroomHash hash = wire::hash_groom(*file);
  made_[hash] = file;
  return hash;
}

// One groom at a time, the one with the most users first.
void GroomStore::learn(std::int64_t now_ns) {
  if (!learner_) return;
  LearningResult result;
  while (learner_->take(result)) take_learnt(std::move(result));
  if (!is_short_())
    short_since_ns_.reset();
  else if (!short_since_ns_)
    short_since_ns_ = now_ns;
  const bool is_wanted =
      limits_.learning == Learning::always ||
      (limits_.learning == Learning::when_short && short_since_ns_ && now_ns - *short_since_ns_ >= kShortFor_ns);
  if (!is_wanted || learning_) return;
  auto most = grooms_.end();
  for (auto groom = grooms_.begin(); groom != grooms_.end(); ++groom) {
    const Entry& entry = groom->second;
    if (entry.state != State::ready || entry.was_learnt || entry.users.empty()) continue;
    if (most == grooms_.end() || entry.users.size() > most->second.users.size()) most = groom;
  }
  if (most == grooms_.end()) return;
  most->second.was_learnt = true;
  LearningJob job{most->first, most->second.levels.lock(), most->second.bytes};
  if (!job.levels || !job.levels->modes) return;
  learning_ = most->first;
  learner_->put(std::move(job));
}

void GroomStore::take_learnt(LearningResult result) {
  HAIRNET_ASSERT(learning_ == result.groom);
  learning_.reset();
  const auto groom = grooms_.find(result.groom);
  if (groom == grooms_.end() || groom->second.state != State::ready) return;
  if (!result.file_detail.empty()) {
    counters_->grooms_learnt_file_refused.add();
    spdlog::info("event=groom_learnt_file_refused groom={} detail={}", log_hash(result.groom),
                 log_text(result.file_detail));
  }
  if (!result.levels) {
    if (result.detail.empty()) return;
    counters_->grooms_learnt_refused.add();
    spdlog::info("event=groom_learnt_refused groom={} detail={}", log_hash(result.groom), log_text(result.detail));
    return;
  }
  const LearntHair& learnt = *result.levels->learnt;
  counters_->grooms_learnt.add();
  if (result.is_adopted) counters_->grooms_learnt_adopted.add();
  if (learnt.wind.weights.empty()) counters_->grooms_learnt_refused_in_wind.add();
  spdlog::info(
      "event=groom_learnt groom={} from={} error={:.3f} low_error={:.3f} wind_error={:.3f} wind_low_error={:.3f} "
      "seconds={:.1f}",
      log_hash(result.groom), result.is_adopted ? "file" : "motions", learnt.error, learnt.low_error, learnt.wind.error,
      learnt.wind.low_error, static_cast<double>(result.taken_ns) * 1e-9);
  const std::size_t bytes = learnt.bytes() + result.file->size();
  groom->second.level_bytes += bytes;
  level_bytes_ += bytes;
  groom->second.levels = result.levels;
  groom->second.was_learnt = true;  // also if the groom came back meanwhile
  builder_->cache(result.groom, result.levels);
  commands_->put(GroomReady{result.groom, std::move(result.levels), nullptr, std::nullopt, offer_made(result.file)});
  groom->second.learnt = std::move(result.file);
}

void GroomStore::refuse_other_size(Grooms::iterator groom, SessionId session, std::int64_t now_ns) {
  counters_->grooms_refused_hash.add();
  const std::uint64_t offered_bytes = groom->second.users.at(session).offered_bytes;
  refuse_user(groom, session,
              {ErrorReason::groom_hash_mismatch,
               fmt::format("the groom of that hash has {} bytes, not {}", groom->second.byte_count, offered_bytes)},
              now_ns);
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
  for (const auto& [session, user] : users) refuse_user(groom, session, refused, now_ns);
  erase(groom);
}

void GroomStore::send(SessionId session, const wire::Message& message, std::int64_t now_ns) {
  listener_.send(session, message, now_ns);
}

void GroomStore::send_state(Grooms::const_iterator groom, GroomState state, std::int64_t now_ns) {
  for (const auto& [session, user] : groom->second.users) send(session, wire::GroomStatus{groom->first, state}, now_ns);
}

void GroomStore::set_upload_bytes(Entry& entry, std::size_t bytes) {
  HAIRNET_ASSERT(upload_bytes_ >= entry.upload_bytes);
  upload_bytes_ += bytes - entry.upload_bytes;
  entry.upload_bytes = bytes;
}

void GroomStore::erase(Grooms::iterator groom) {
  Entry& entry = groom->second;
  while (!entry.uploads.empty()) end_upload(groom, entry.uploads.begin()->first);
  if (entry.job != 0) builder_->drop(entry.job);
  if (learning_ == groom->first) learner_->drop();
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
