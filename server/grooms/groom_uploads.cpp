#include "server/grooms/groom_uploads.hpp"

#include <fmt/format.h>

#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;

}  // namespace

Refused GroomUploads::begin(const UploadId& id, std::uint64_t byte_count, std::int64_t now_ns) {
  HAIRNET_ASSERT(byte_count > 0);
  // A session's first upload starts with a full bucket.
  const TokenBucket full(limits_.upload_bytes_per_s, limits_.upload_burst_bytes, now_ns);
  Account& own = accounts_.try_emplace(id.session, Account{.bytes = full}).first->second;
  // The announced size is charged at once: a session cannot announce more than it may upload and hold places with it.
  if (!own.bytes.take(static_cast<double>(byte_count), now_ns)) {
    counters_->grooms_refused_rate.add();
    return {ErrorReason::limit_exceeded,
            fmt::format("more than {:.0f} bytes of grooms a second; try again later", limits_.upload_bytes_per_s)};
  }
  // The timeout counts over all uploads of the session; it begins with the first.
  if (own.upload_count++ == 0) restart_timeout(id.session, now_ns);
  const auto [upload, is_new] = uploads_.try_emplace(id);
  HAIRNET_ASSERT(is_new);
  upload->second.byte_count = byte_count;
  return {};
}

void GroomUploads::end(const UploadId& id) {
  const auto upload = uploads_.find(id);
  HAIRNET_ASSERT(upload != uploads_.end());
  bytes_ -= upload->second.received;
  // The bytes that were announced stay charged: otherwise broken uploads would be free.
  uploads_.erase(upload);
  --accounts_.at(id.session).upload_count;
}

void GroomUploads::end_all(const wire::GroomHash& groom) {
  for (auto first = first_of(groom); first != uploads_.end() && first->first.groom == groom; first = first_of(groom))
    end(UploadId(first->first));
}

void GroomUploads::close(SessionId session) {
  HAIRNET_ASSERT(uploads_of(session).empty());
  accounts_.erase(session);
}

void GroomUploads::restart_timeout(SessionId session, std::int64_t now_ns) {
  const auto own = accounts_.find(session);
  if (own == accounts_.end()) return;
  own->second.since_ns = now_ns;
  own->second.received = 0;
}

bool GroomUploads::has_any(const wire::GroomHash& groom) const {
  const auto first = first_of(groom);
  return first != uploads_.end() && first->first.groom == groom;
}

bool GroomUploads::has_any_of_sharer(const UploadId& id) const {
  const Sharer own = shares_->sharer_of(id.session);
  for (auto upload = first_of(id.groom); upload != uploads_.end() && upload->first.groom == id.groom; ++upload) {
    if (shares_->sharer_of(upload->first.session) == own) return true;
  }
  return false;
}

std::optional<std::uint64_t> GroomUploads::received(const UploadId& id) const {
  const auto upload = uploads_.find(id);
  return upload == uploads_.end() ? std::nullopt : std::optional(upload->second.received);
}

Refused GroomUploads::check(SessionId session, const wire::GroomChunk& chunk) const {
  const auto found = uploads_.find({chunk.hash, session});
  if (found == uploads_.end()) return {ErrorReason::unexpected_message, "a chunk that was not asked for"};
  const Upload& upload = found->second;
  if (chunk.bytes.empty() || chunk.bytes.size() > wire::kGroomChunkBytesMax)
    return {ErrorReason::limit_exceeded, fmt::format("a chunk of {} bytes", chunk.bytes.size())};
  // A connection keeps the order of chunks, so a gap is an error of the client. Chunks that are sent twice after a
  // resume are taken out before (GroomStore::chunk).
  if (chunk.offset != upload.received)
    return {ErrorReason::unexpected_message,
            fmt::format("a chunk at {}, where {} was expected", chunk.offset, upload.received)};
  // A subtraction and not a sum: the sum could overflow.
  if (chunk.bytes.size() > upload.byte_count - upload.received)
    return {ErrorReason::limit_exceeded, fmt::format("more than the {} bytes offered", upload.byte_count)};
  return {};
}

bool GroomUploads::put(SessionId session, wire::GroomChunk chunk) {
  Upload& upload = uploads_.at({chunk.hash, session});
  HAIRNET_ASSERT(chunk.offset == upload.received);
  const std::size_t count = chunk.bytes.size();
  accounts_.at(session).received += count;
  upload.received += count;
  bytes_ += count;
  counters_->groom_bytes_received.add(count);
  upload.hasher.add(chunk.bytes);
  // A buffer may have more capacity than bytes, which bytes_ would not count.
  chunk.bytes.shrink_to_fit();
  upload.chunks.push_back(std::move(chunk.bytes));
  return upload.received == upload.byte_count;
}

std::optional<GroomUploads::Chunks> GroomUploads::take(const UploadId& id) {
  Upload& upload = uploads_.at(id);
  if (upload.hasher.hash() != id.groom) return std::nullopt;
  // The hash is right, so the other uploads of the groom have nothing to add and end.
  Chunks chunks = std::move(upload.chunks);
  end_all(id.groom);
  return chunks;
}

std::set<SessionId> GroomUploads::take_stalled(std::int64_t now_ns) {
  std::set<SessionId> stalled;
  for (auto& [session, own] : accounts_) {
    if (own.upload_count == 0 || now_ns - own.since_ns <= limits_.upload_timeout_ns) continue;
    const double bytes_min = limits_.upload_bytes_per_s_min * 1e-9 * static_cast<double>(now_ns - own.since_ns);
    // A session that holds a place and sends a byte now and then would block others; a slow honest line passes with 8
    // KiB a second by default.
    if (own.received == 0 || static_cast<double>(own.received) < bytes_min) stalled.insert(session);
    restart_timeout(session, now_ns);
  }
  return stalled;
}

std::vector<UploadId> GroomUploads::uploads_of(SessionId session) const {
  std::vector<UploadId> ids;
  for (const auto& [id, upload] : uploads_) {
    if (id.session == session) ids.push_back(id);
  }
  return ids;
}

std::optional<UploadId> GroomUploads::to_end_for(SessionId session, Scarce what, std::uint64_t more) const {
  const auto held_by = [what](const Upload& upload) { return what == Scarce::bytes ? upload.received : 1; };
  std::map<Sharer, std::uint64_t> held;
  for (const auto& [id, upload] : uploads_) held[shares_->sharer_of(id.session)] += held_by(upload);
  const std::optional<Sharer> most = shares_->sharer_with_most(std::move(held), session, more);
  for (auto upload = uploads_.begin(); most && upload != uploads_.end(); ++upload) {
    // An upload that has received nothing would free no bytes.
    if (shares_->sharer_of(upload->first.session) == *most && held_by(upload->second) > 0) return upload->first;
  }
  return std::nullopt;
}

std::optional<UploadId> GroomUploads::largest() const {
  const auto most = std::ranges::max_element(uploads_, {}, [](const auto& u) { return u.second.received; });
  return most == uploads_.end() || most->second.received == 0 ? std::nullopt : std::optional(most->first);
}

void GroomUploads::check_invariants() const {
#ifdef HAIRNET_VALIDATE_ON
  std::size_t bytes = 0;
  std::map<SessionId, std::size_t> counts;
  for (const auto& [id, upload] : uploads_) {
    HAIRNET_ASSERT(upload.received < upload.byte_count);
    bytes += upload.received;
    ++counts[id.session];
  }
  HAIRNET_ASSERT(bytes == bytes_);
  for (const auto& [session, own] : accounts_)
    HAIRNET_ASSERT(own.upload_count == (counts.contains(session) ? counts[session] : 0));
#endif
}

}  // namespace hairnet::server
