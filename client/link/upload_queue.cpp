#include "client/link/upload_queue.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::link {

// The wanted grooms are uploads, each wanted once, and each with bytes left to send.
void UploadQueue::check_invariants() const {
  HAIRNET_ASSERT(wanted_.size() <= uploads_.size());
#ifdef HAIRNET_VALIDATE_ON
  for (const wire::GroomHash& hash : wanted_) {
    HAIRNET_ASSERT(std::ranges::count(wanted_, hash) == 1);
    HAIRNET_ASSERT(uploads_.contains(hash));
    HAIRNET_ASSERT(uploads_.at(hash).sent_bytes < uploads_.at(hash).bytes->size());
  }
#endif
}

std::optional<wire::GroomOffer> UploadQueue::offer(const wire::GroomHash& hash, Bytes bytes) {
  HAIRNET_ASSERT(bytes);
  const wire::GroomOffer offer{hash, bytes->size()};
  if (!uploads_.try_emplace(hash, Upload{std::move(bytes), 0}).second) return std::nullopt;
  return offer;
}

bool UploadQueue::need(const wire::GroomNeed& need) {
  const auto found = uploads_.find(need.hash);
  if (found == uploads_.end() || need.offset > found->second.bytes->size()) return false;
  // The server may ask again from any offset, also while an upload runs: the newest request counts alone.
  std::erase(wanted_, need.hash);
  found->second.sent_bytes = need.offset;
  if (need.offset < found->second.bytes->size()) wanted_.push_back(need.hash);
  check_invariants();
  return true;
}

void UploadQueue::drop(const wire::GroomHash& hash) {
  uploads_.erase(hash);
  std::erase(wanted_, hash);
  check_invariants();
}

void UploadQueue::clear() {
  uploads_.clear();
  wanted_.clear();
}

std::optional<wire::GroomChunk> UploadQueue::next_chunk() {
  if (wanted_.empty()) return std::nullopt;
  const wire::GroomHash hash = wanted_.front();
  HAIRNET_ASSERT(uploads_.contains(hash));
  Upload& upload = uploads_.at(hash);
  const std::vector<std::uint8_t>& bytes = *upload.bytes;
  HAIRNET_ASSERT(upload.sent_bytes < bytes.size());
  const std::size_t count = std::min<std::size_t>(chunk_bytes_, bytes.size() - upload.sent_bytes);
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(upload.sent_bytes);
  wire::GroomChunk chunk{hash, upload.sent_bytes, {begin, begin + static_cast<std::ptrdiff_t>(count)}};
  upload.sent_bytes += count;
  // The bytes stay here until drop(): the server may ask for them again.
  if (upload.sent_bytes == bytes.size()) wanted_.pop_front();
  check_invariants();
  return chunk;
}

}  // namespace hairnet::link
