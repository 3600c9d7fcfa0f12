#include "server/tick/groom_store.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "server/room/log_text.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;
using wire::GroomState;

template <class T>
std::size_t bytes_of(const std::vector<T>& items) {
  return items.size() * sizeof(T);
}

std::size_t bytes_of(const Stiffeners& s) {
  return bytes_of(s.begin) + bytes_of(s.nodes) + bytes_of(s.weights) + bytes_of(s.stiffness) + bytes_of(s.damping) +
         bytes_of(s.rest);
}

std::size_t bytes_of(const Level& level) {
  const LevelGeometry& g = level.geometry;
  std::size_t bytes = sizeof(Level) + bytes_of(g.active_nodes) + bytes_of(g.trimmed_nodes) + bytes_of(g.trimmed_begin) +
                      bytes_of(g.trimmed_from) + bytes_of(g.trimmed_weights) + bytes_of(level.rest) +
                      bytes_of(level.mass) + bytes_of(level.ether_stiffness) + bytes_of(level.ether_damping) +
                      bytes_of(level.drag) + bytes_of(level.springs) + bytes_of(level.attachments) +
                      bytes_of(level.metaballs);
  for (const Metaball& ball : level.metaballs) bytes += bytes_of(ball.radius) + bytes_of(ball.potential);
  return bytes;
}

std::string hex(const wire::GroomHash& hash) {
  return fmt::format("{:02x}{:02x}{:02x}{:02x}", hash[0], hash[1], hash[2], hash[3]);
}

}  // namespace

GroomStore::GroomStore(const GroomStoreLimits& limits, GroomBuilder& builder, CommandQueue& commands,
                       GroomCounters& counters, Notify notify)
    : limits_(limits), builder_(&builder), commands_(&commands), counters_(&counters), notify_(std::move(notify)) {}

Refused GroomStore::offer(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns) {
  counters_->grooms_offered.add();
  if (offer.byte_count == 0 || offer.byte_count > limits_.groom_bytes_max) {
    counters_->grooms_refused_size.add();
    return {ErrorReason::limit_exceeded,
            fmt::format("a groom of {} bytes; 1 to {} are taken", offer.byte_count, limits_.groom_bytes_max)};
  }
  const auto groom = grooms_.find(offer.hash);
  const bool held = groom != grooms_.end() && groom->second.holders.contains(session);
  if (!held && held_by(session) >= limits_.grooms_per_session_max) {
    counters_->grooms_refused_limit.add();
    return {ErrorReason::limit_exceeded, fmt::format("at most {} grooms a session", limits_.grooms_per_session_max)};
  }
  if (groom == grooms_.end()) return begin_upload(session, offer, now_ns);
  Entry& entry = groom->second;
  if (entry.byte_count != offer.byte_count) {
    counters_->grooms_refused_hash.add();
    return {ErrorReason::groom_hash_mismatch,
            fmt::format("the groom of that hash has {} bytes, not {}", entry.byte_count, offer.byte_count)};
  }
  entry.holders.insert(session);
  entry.used = ++uses_;
  if (entry.state == State::uploading && entry.uploader == session) {
    notify_(session, wire::GroomNeed{offer.hash, entry.received}, now_ns);
    return {};
  }
  if (!held) counters_->grooms_shared.add();
  notify_(session, wire::GroomNeed{offer.hash, offer.byte_count}, now_ns);
  notify_(session, wire::GroomStatus{offer.hash, state_of(entry)}, now_ns);
  return {};
}

wire::GroomState GroomStore::state_of(const Entry& entry) {
  return entry.state == State::ready      ? GroomState::ready
         : entry.state == State::building ? GroomState::building
                                          : GroomState::queued;
}

void GroomStore::tell_states(SessionId session, std::int64_t now_ns) {
  for (const auto& [hash, entry] : grooms_) {
    if (!entry.holders.contains(session)) continue;
    if (entry.state == State::uploading && entry.uploader == session)
      notify_(session, wire::GroomNeed{hash, entry.received}, now_ns);
    else
      notify_(session, wire::GroomStatus{hash, state_of(entry)}, now_ns);
  }
}

std::shared_ptr<const std::vector<std::uint8_t>> GroomStore::bytes(const wire::GroomHash& hash) {
  const auto groom = grooms_.find(hash);
  if (groom == grooms_.end()) return nullptr;
  groom->second.used = ++uses_;
  return groom->second.bytes;
}

Refused GroomStore::begin_upload(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns) {
  while (grooms_.size() >= limits_.groom_count_max) {
    if (evict_one()) continue;
    counters_->grooms_refused_limit.add();
    return {ErrorReason::limit_exceeded, "the server holds its grooms' number"};
  }
  if (upload_bytes_ + offer.byte_count > limits_.upload_bytes_max) {
    counters_->grooms_refused_limit.add();
    return {ErrorReason::limit_exceeded, "too many bytes are being uploaded; try again"};
  }
  Entry& entry = grooms_[offer.hash];
  entry.byte_count = offer.byte_count;
  entry.uploader = session;
  entry.progress_ns = now_ns;
  entry.holders.insert(session);
  entry.used = ++uses_;
  upload_bytes_ += offer.byte_count;
  notify_(session, wire::GroomNeed{offer.hash, 0}, now_ns);
  return {};
}

Refused GroomStore::chunk(SessionId session, wire::GroomChunk chunk, std::int64_t now_ns) {
  const auto groom = grooms_.find(chunk.hash);
  if (groom == grooms_.end() || !groom->second.holders.contains(session))
    return {ErrorReason::groom_unknown, "a chunk of a groom that was not offered"};
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
  entry.progress_ns = now_ns;
  counters_->groom_bytes_received.add(chunk.bytes.size());
  chunk.bytes.shrink_to_fit();
  entry.chunks.push_back(std::move(chunk.bytes));
  return entry.received == entry.byte_count ? finish_upload(groom, now_ns) : Refused{};
}

Refused GroomStore::finish_upload(Grooms::iterator groom, std::int64_t now_ns) {
  counters_->grooms_uploaded.add();
  GroomJob job{groom->first, std::move(groom->second.chunks)};
  if (!builder_->try_put(job)) {
    counters_->grooms_refused_queue_full.add();
    tell_state(groom, GroomState::refused, now_ns);
    erase(groom);
    return {ErrorReason::groom_build_queue_full, "too many grooms wait to be built; try again"};
  }
  groom->second.chunks.clear();
  groom->second.state = State::queued;
  tell_state(groom, GroomState::queued, now_ns);
  return {};
}

Refused GroomStore::hold(SessionId session, const wire::GroomHash& hash) {
  const auto groom = grooms_.find(hash);
  if (groom == grooms_.end()) return {ErrorReason::groom_unknown, "offer the groom first"};
  if (!groom->second.holders.contains(session) && held_by(session) >= limits_.grooms_per_session_max)
    return {ErrorReason::limit_exceeded, fmt::format("at most {} grooms a session", limits_.grooms_per_session_max)};
  groom->second.holders.insert(session);
  groom->second.used = ++uses_;
  return {};
}

bool GroomStore::ready(const wire::GroomHash& hash) const {
  const auto groom = grooms_.find(hash);
  return groom != grooms_.end() && groom->second.state == State::ready;
}

void GroomStore::release(SessionId session, std::int64_t now_ns) {
  for (auto groom = grooms_.begin(); groom != grooms_.end();) {
    const auto next = std::next(groom);
    Entry& entry = groom->second;
    entry.holders.erase(session);
    if (entry.state == State::uploading && entry.uploader == session) pass_on(groom, now_ns);
    groom = next;
  }
}

void GroomStore::pass_on(Grooms::iterator groom, std::int64_t now_ns) {
  Entry& entry = groom->second;
  if (entry.holders.empty()) return erase(groom);
  entry.uploader = *entry.holders.begin();
  entry.progress_ns = now_ns;
  notify_(entry.uploader, wire::GroomNeed{groom->first, entry.received}, now_ns);
}

void GroomStore::poll(std::int64_t now_ns) {
  GroomResult result;
  while (builder_->take(result)) take(std::move(result), now_ns);
  for (auto groom = grooms_.begin(); groom != grooms_.end();) {
    const auto next = std::next(groom);
    Entry& entry = groom->second;
    if (entry.state == State::uploading && now_ns - entry.progress_ns > limits_.upload_timeout_ns) {
      counters_->grooms_refused_stalled.add();
      const SessionId stalled = entry.uploader;
      notify_(stalled, wire::Error{ErrorReason::limit_exceeded, 0, groom->first, "the upload stalled"}, now_ns);
      notify_(stalled, wire::GroomStatus{groom->first, GroomState::refused}, now_ns);
      entry.holders.erase(stalled);
      pass_on(groom, now_ns);
    }
    groom = next;
  }
  counters_->gauges.grooms.set(static_cast<double>(grooms_.size()));
  counters_->gauges.groom_upload_bytes.set(static_cast<double>(upload_bytes_));
  counters_->gauges.groom_level_bytes.set(static_cast<double>(level_bytes_));
}

void GroomStore::take(GroomResult result, std::int64_t now_ns) {
  const auto groom = grooms_.find(result.hash);
  if (groom == grooms_.end()) return;
  switch (result.state) {
    case GroomState::queued:
      break;
    case GroomState::building:
      groom->second.state = State::building;
      tell_state(groom, GroomState::building, now_ns);
      break;
    case GroomState::ready:
      take_ready(groom, std::move(result), now_ns);
      break;
    case GroomState::refused:
      take_refused(groom, result, now_ns);
      break;
  }
}

void GroomStore::take_ready(Grooms::iterator groom, GroomResult result, std::int64_t now_ns) {
  std::size_t bytes = result.bytes ? result.bytes->size() : 0;
  for (const Level& level : result.levels->levels) bytes += bytes_of(level);
  while (level_bytes_ + bytes > limits_.level_bytes_max && evict_one()) {
  }
  if (level_bytes_ + bytes > limits_.level_bytes_max) {
    result.reason = ErrorReason::limit_exceeded;
    result.detail = "the server has no room for more levels";
    return take_refused(groom, result, now_ns);
  }
  Entry& entry = groom->second;
  entry.state = State::ready;
  entry.level_bytes = bytes;
  level_bytes_ += bytes;
  upload_bytes_ -= entry.byte_count;
  counters_->grooms_ready.add();
  spdlog::info("event=groom_ready groom={} level_bytes={}", hex(groom->first), bytes);
  entry.bytes = result.bytes;
  commands_->put(GroomReady{groom->first, std::move(result.levels), std::move(result.bytes)});
  tell_state(groom, GroomState::ready, now_ns);
}

void GroomStore::take_refused(Grooms::iterator groom, const GroomResult& result, std::int64_t now_ns) {
  spdlog::info("event=groom_refused groom={} reason={} why={}", hex(groom->first), to_string(result.reason),
               log_text(result.detail));
  Entry& entry = groom->second;
  const wire::Error error{result.reason, 0, groom->first, result.detail};
  if (result.reason == ErrorReason::groom_hash_mismatch) {
    // One wrong uploader must not spoil the groom for the others.
    counters_->grooms_refused_hash.add();
    if (entry.holders.erase(entry.uploader)) {
      notify_(entry.uploader, error, now_ns);
      notify_(entry.uploader, wire::GroomStatus{groom->first, GroomState::refused}, now_ns);
    }
    entry.state = State::uploading;
    entry.received = 0;
    return pass_on(groom, now_ns);
  }
  (result.reason == ErrorReason::groom_invalid ? counters_->grooms_refused_invalid : counters_->grooms_refused_limit)
      .add();
  for (const SessionId holder : entry.holders) notify_(holder, error, now_ns);
  tell_state(groom, GroomState::refused, now_ns);
  erase(groom);
}

void GroomStore::tell_state(Grooms::const_iterator groom, GroomState state, std::int64_t now_ns) {
  for (const SessionId holder : groom->second.holders) notify_(holder, wire::GroomStatus{groom->first, state}, now_ns);
}

void GroomStore::erase(Grooms::iterator groom) {
  if (groom->second.state == State::ready) {
    level_bytes_ -= groom->second.level_bytes;
    commands_->put(ForgetGroom{groom->first});
  } else {
    upload_bytes_ -= groom->second.byte_count;
  }
  grooms_.erase(groom);
}

bool GroomStore::evict_one() {
  auto oldest = grooms_.end();
  for (auto groom = grooms_.begin(); groom != grooms_.end(); ++groom) {
    if (groom->second.state != State::ready || !groom->second.holders.empty()) continue;
    if (oldest == grooms_.end() || groom->second.used < oldest->second.used) oldest = groom;
  }
  if (oldest == grooms_.end()) return false;
  counters_->grooms_evicted.add();
  erase(oldest);
  return true;
}

std::size_t GroomStore::holder_count() const {
  std::size_t count = 0;
  for (const auto& [hash, entry] : grooms_) count += entry.holders.size();
  return count;
}

std::size_t GroomStore::held_by(SessionId session) const {
  std::size_t count = 0;
  for (const auto& [hash, entry] : grooms_) count += entry.holders.contains(session);
  return count;
}

}  // namespace hairnet::server
