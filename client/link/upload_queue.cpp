#include "client/link/upload_queue.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::link {

std::optional<wire::GroomOffer> UploadQueue::offer(const wire::GroomHash& hash, Bytes bytes) {
  const wire::GroomOffer offer{hash, bytes->size()};
  if (!uploads_.try_emplace(hash, Upload{std::move(bytes), 0}).second) return std::nullopt;
  return offer;
}

bool UploadQueue::need(const wire::GroomNeed& need) {
  const auto found = uploads_.find(need.hash);
  if (found == uploads_.end() || need.offset > found->second.bytes->size()) return false;
  std::erase(wanted_, need.hash);
  found->second.sent_bytes = need.offset;
  if (need.offset < found->second.bytes->size()) wanted_.push_back(need.hash);
  return true;
}

void UploadQueue::drop(const wire::GroomHash& hash) {
  uploads_.erase(hash);
  std::erase(wanted_, hash);
}

void UploadQueue::clear() {
  uploads_.clear();
  wanted_.clear();
}

std::optional<wire::GroomChunk> UploadQueue::next_chunk() {
  if (wanted_.empty()) return std::nullopt;
  const wire::GroomHash hash = wanted_.front();
  Upload& upload = uploads_.at(hash);
  const std::vector<std::uint8_t>& bytes = *upload.bytes;
  const std::size_t count = std::min<std::size_t>(chunk_bytes_, bytes.size() - upload.sent_bytes);
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(upload.sent_bytes);
  wire::GroomChunk chunk{hash, upload.sent_bytes, {begin, begin + static_cast<std::ptrdiff_t>(count)}};
  upload.sent_bytes += count;
  if (upload.sent_bytes == bytes.size()) wanted_.pop_front();
  return chunk;
}

}  // namespace hairnet::link
