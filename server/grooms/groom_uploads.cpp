#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "core/assert.hpp"
#include "server/grooms/groom_store.hpp"

// The uploads of GroomStore: from the request for a groom's bytes to the last of them.
namespace hairnet::server {
namespace {

using wire::ErrorReason;
using wire::GroomState;

}  // namespace

Refused GroomStore::make_place(SessionId session, std::int64_t now_ns) {
  while (grooms_.size() >= limits_.groom_count_max) {
    if (evict_one()) continue;
    // Who has most unfinished uploads loses one, unless that is this session's own.
    std::map<Sharer, std::size_t> counts;
    for (const auto& [id, own] : accounts_) counts[sharer_of(id)] += own.upload_count;
    const auto most = std::ranges::max_element(counts, {}, [](const auto& c) { return c.second; });
    const Refused refused{ErrorReason::limit_exceeded, "the server has its maximum number of grooms; try again"};
    if (most == counts.end() || most->second <= counts[sharer_of(session)] + 1) {
      counters_->grooms_refused_limit.add();
      return refused;
    }
    const auto is_losers = [&](const auto& upload) { return sharer_of(upload.first) == most->first; };
    const auto lost =
        std::ranges::find_if(grooms_, [&](const auto& g) { return std::ranges::any_of(g.second.uploads, is_losers); });
    HAIRNET_ASSERT(lost != grooms_.end());
    counters_->grooms_refused_limit.add();
    refuse_upload(lost, std::ranges::find_if(lost->second.uploads, is_losers)->first, refused, now_ns);
  }
  return {};
}

bool GroomStore::search(Grooms::iterator groom, std::int64_t now_ns) {
  HAIRNET_ASSERT(groom->second.uploads.empty());
  const bool is_under_way = searches_.contains(groom->first);
  if (!is_under_way && !(objects_ && objects_->find(groom->first))) return false;
  searches_.insert(groom->first);
  groom->second.state = State::searched;
  groom->second.asked_ns = now_ns;
  return true;
}

void GroomStore::take_found(const ObjectSync::Found& found, std::int64_t now_ns) {
  searches_.erase(found.groom);
  const auto groom = grooms_.find(found.groom);
  if (groom == grooms_.end() || groom->second.state != State::searched) return;
  if (!found.is_cached) return go_on_without(groom, now_ns);
  const auto& users = groom->second.users;
  queue(groom->second, users.empty() ? 0 : users.begin()->first);
  for (const auto& [session, user] : groom->second.users) {
    if (user.offered_bytes == 0) continue;
    counters_->grooms_shared.add();
    send(session, wire::GroomNeed{groom->first, user.offered_bytes}, now_ns);
  }
  send_state(groom, GroomState::queued, now_ns);
  feed_builder();
}

Refused GroomStore::ask(Grooms::iterator groom, SessionId session, std::int64_t now_ns) {
  Entry& entry = groom->second;
  HAIRNET_ASSERT(entry.users.contains(session));
  HAIRNET_ASSERT(!entry.uploads.contains(session));
  User& user = entry.users.at(session);
  HAIRNET_ASSERT(user.offered_bytes > 0);
  Account& own = account(session, now_ns);
  if (!own.bytes.take(static_cast<double>(user.offered_bytes), now_ns)) {
    counters_->grooms_refused_rate.add();
    return {ErrorReason::limit_exceeded,
            fmt::format("more than {:.0f} bytes of grooms a second; try again later", limits_.upload_bytes_per_s)};
  }
  if (own.upload_count++ == 0) {
    own.since_ns = now_ns;
    own.received = 0;
  }
  user.was_asked = true;
  entry.state = State::uploading;
  entry.uploads.try_emplace(session);
  entry.asked_ns = now_ns;
  send(session, wire::GroomNeed{groom->first, 0}, now_ns);
  return {};
}

bool GroomStore::ask_next(Grooms::iterator groom, std::int64_t now_ns) {
  Entry& entry = groom->second;
  const auto users = entry.users;
  for (const auto& [session, user] : users) {
    const auto is_of_same = [&, own = sharer_of(session)](const auto& upload) {
      return sharer_of(upload.first) == own;
    };
    if (user.offered_bytes == 0 || std::ranges::any_of(entry.uploads, is_of_same)) continue;
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
  const auto upload = groom->second.uploads.find(session);
  // Bytes that are here already, or that were asked for until another session brought them.
  const bool is_repeated =
      upload == groom->second.uploads.end()
          ? groom->second.users.at(session).was_asked
          : chunk.offset < upload->second.received && chunk.bytes.size() <= upload->second.received - chunk.offset;
  if (is_repeated && !chunk.bytes.empty()) return {};
  Refused refused = put_chunk(groom, session, std::move(chunk), now_ns);
  const bool was_taken = !refused;
  return {std::move(refused), was_taken};
}

Refused GroomStore::put_chunk(Grooms::iterator groom, SessionId session, wire::GroomChunk chunk, std::int64_t now_ns) {
  Entry& entry = groom->second;
  const auto found = entry.uploads.find(session);
  if (found == entry.uploads.end()) return {ErrorReason::unexpected_message, "a chunk that was not asked for"};
  Upload& upload = found->second;
  const std::uint64_t byte_count = entry.users.at(session).offered_bytes;
  if (chunk.bytes.empty() || chunk.bytes.size() > wire::kGroomChunkBytesMax)
    return {ErrorReason::limit_exceeded, fmt::format("a chunk of {} bytes", chunk.bytes.size())};
  if (chunk.offset != upload.received)
    return {ErrorReason::unexpected_message,
            fmt::format("a chunk at {}, where {} was expected", chunk.offset, upload.received)};
  if (chunk.bytes.size() > byte_count - upload.received)
    return {ErrorReason::limit_exceeded, fmt::format("more than the {} bytes offered", byte_count)};
  if (!make_room(session, chunk.bytes.size(), now_ns)) {
    counters_->grooms_refused_limit.add();
    refuse_upload(groom, session, {ErrorReason::limit_exceeded, "too many bytes are being uploaded; try again"},
                  now_ns);
    return {};
  }
  Account& own = account(session, now_ns);
  own.received += chunk.bytes.size();
  upload.received += chunk.bytes.size();
  set_upload_bytes(entry, entry.upload_bytes + chunk.bytes.size());
  counters_->groom_bytes_received.add(chunk.bytes.size());
  upload.hasher.add(chunk.bytes);
  chunk.bytes.shrink_to_fit();
  upload.chunks.push_back(std::move(chunk.bytes));
  return upload.received == byte_count ? finish_upload(groom, session, now_ns) : Refused{};
}

bool GroomStore::make_room(SessionId session, std::size_t bytes, std::int64_t now_ns) {
  while (upload_bytes_ + bytes > limits_.upload_bytes_max) {
    std::map<Sharer, std::size_t> held;
    for (const auto& [hash, entry] : grooms_) {
      for (const auto& [uploader, upload] : entry.uploads) held[sharer_of(uploader)] += upload.received;
    }
    const auto most = std::ranges::max_element(held, {}, [](const auto& h) { return h.second; });
    if (most == held.end() || most->second <= held[sharer_of(session)] + bytes) return false;
    const auto is_losers = [&](const auto& upload) {
      return upload.second.received > 0 && sharer_of(upload.first) == most->first;
    };
    const auto lost =
        std::ranges::find_if(grooms_, [&](const auto& g) { return std::ranges::any_of(g.second.uploads, is_losers); });
    HAIRNET_ASSERT(lost != grooms_.end());
    counters_->grooms_refused_limit.add();
    refuse_upload(lost, std::ranges::find_if(lost->second.uploads, is_losers)->first,
                  {ErrorReason::limit_exceeded, "too many bytes are being uploaded; try again"}, now_ns);
  }
  return true;
}

void GroomStore::free_memory(std::int64_t now_ns) {
  if (evict_one()) return;
  auto lost = grooms_.end();
  SessionId uploader = 0;
  std::uint64_t most = 0;
  for (auto groom = grooms_.begin(); groom != grooms_.end(); ++groom) {
    for (const auto& [session, upload] : groom->second.uploads) {
      if (upload.received <= most) continue;
      most = upload.received;
      lost = groom;
      uploader = session;
    }
  }
  if (lost == grooms_.end()) return;
  counters_->grooms_refused_limit.add();
  refuse_upload(lost, uploader, {ErrorReason::limit_exceeded, "the server has no memory left; try again"}, now_ns);
}

Refused GroomStore::finish_upload(Grooms::iterator groom, SessionId session, std::int64_t now_ns) {
  Entry& entry = groom->second;
  if (entry.uploads.at(session).hasher.hash() != groom->first) {
    counters_->grooms_refused_hash.add();
    refuse_upload(groom, session, {ErrorReason::groom_hash_mismatch, "the bytes do not have the offered hash"}, now_ns);
    return {};
  }
  counters_->grooms_uploaded.add();
  if (Refused refused = make_place_in_queue(session, now_ns)) {
    send_state(groom, GroomState::refused, now_ns);
    erase(groom);
    return refused;
  }
  entry.byte_count = entry.users.at(session).offered_bytes;
  entry.chunks = std::move(entry.uploads.at(session).chunks);
  while (!entry.uploads.empty()) end_upload(groom, entry.uploads.begin()->first);
  set_upload_bytes(entry, entry.byte_count);
  queue(entry, session);
  const auto users = entry.users;
  for (const auto& [user, its] : users) {
    if (its.offered_bytes != 0 && its.offered_bytes != entry.byte_count) refuse_other_size(groom, user, now_ns);
  }
  send_state(groom, GroomState::queued, now_ns);
  feed_builder();
  return {};
}

void GroomStore::end_upload(Grooms::iterator groom, SessionId session) {
  Entry& entry = groom->second;
  const auto upload = entry.uploads.find(session);
  HAIRNET_ASSERT(upload != entry.uploads.end());
  set_upload_bytes(entry, entry.upload_bytes - upload->second.received);
  entry.uploads.erase(upload);
  const auto own = accounts_.find(session);
  if (own == accounts_.end()) return;
  HAIRNET_ASSERT(own->second.upload_count > 0);
  --own->second.upload_count;
}

void GroomStore::refuse_upload(Grooms::iterator groom, SessionId session, const Refused& refused, std::int64_t now_ns) {
  end_upload(groom, session);
  refuse_user(groom, session, refused, now_ns);
  go_on_without(groom, now_ns);
}

void GroomStore::go_on_without(Grooms::iterator groom, std::int64_t now_ns) {
  Entry& entry = groom->second;
  if (entry.users.empty()) return erase(groom);
  if (!entry.uploads.empty() || ask_next(groom, now_ns)) return;
  if (entry.users.empty()) return erase(groom);
  refuse_all(groom, {ErrorReason::groom_unknown, "no connected session has the groom; offer it"},
             counters_->grooms_refused_absent, now_ns);
}

// Uploads that are too slow end. A user who has waited for another's, or for the object store, for too long is asked
// for its own bytes.
void GroomStore::check_uploads(std::int64_t now_ns) {
  std::set<SessionId> stalled;
  for (auto& [session, own] : accounts_) {
    if (own.upload_count == 0 || now_ns - own.since_ns <= limits_.upload_timeout_ns) continue;
    const double bytes_min = limits_.upload_bytes_per_s_min * 1e-9 * static_cast<double>(now_ns - own.since_ns);
    if (own.received == 0 || static_cast<double>(own.received) < bytes_min) stalled.insert(session);
    own.since_ns = now_ns;
    own.received = 0;
  }
  for (const SessionId session : stalled) {
    for (auto groom = grooms_.begin(); groom != grooms_.end();) {
      const auto next = std::next(groom);
      if (groom->second.uploads.contains(session)) {
        counters_->grooms_refused_stalled.add();
        refuse_upload(groom, session, {ErrorReason::limit_exceeded, "the upload stalled"}, now_ns);
      }
      groom = next;
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

}  // namespace hairnet::server
