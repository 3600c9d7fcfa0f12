#include "schema/quic/send_buffer.hpp"

#include <utility>

#include "core/assert.hpp"

namespace hairnet::quic {

void SendBuffer::push(std::vector<std::uint8_t> bytes) {
  // No chunk is empty, so that peek() never makes an empty piece.
  if (is_ended_ || bytes.empty()) return;
  end_ += bytes.size();
  chunks_.push_back(std::move(bytes));
}

std::size_t SendBuffer::peek(std::span<ngtcp2_vec> into) const {
  std::size_t count = 0, offset = next_in_chunk_;
  for (std::size_t chunk = next_chunk_; chunk < chunks_.size() && count < into.size(); ++chunk, offset = 0) {
    const std::vector<std::uint8_t>& bytes = chunks_[chunk];
    into[count++] = {const_cast<std::uint8_t*>(bytes.data()) + offset, bytes.size() - offset};
  }
  return count;
}

bool SendBuffer::reaches_end(std::span<const ngtcp2_vec> pieces) const {
  std::uint64_t bytes = 0;
  for (const ngtcp2_vec& piece : pieces) bytes += piece.len;
  return is_ended_ && next_ + bytes == end_;
}

void SendBuffer::mark_sent(std::size_t bytes, bool with_end) {
  HAIRNET_ASSERT(next_ + bytes <= end_);
  next_ += bytes;
  next_in_chunk_ += bytes;
  while (next_chunk_ < chunks_.size() && next_in_chunk_ >= chunks_[next_chunk_].size())
    next_in_chunk_ -= chunks_[next_chunk_++].size();
  if (with_end && next_ == end_) is_end_sent_ = true;
}

void SendBuffer::acknowledge(std::uint64_t offset) {
  HAIRNET_ASSERT(offset <= next_);
  // Only whole chunks are freed: ngtcp2 may still point into the one that is acknowledged in part.
  while (!chunks_.empty() && begin_ + chunks_.front().size() <= offset) {
    begin_ += chunks_.front().size();
    chunks_.pop_front();
    HAIRNET_ASSERT(next_chunk_ > 0);
    --next_chunk_;
  }
}

void SendBuffer::reset() {
  // Unsent chunks go. Sent ones stay, since ngtcp2 keeps pointers to them until it has closed the stream.
  chunks_.resize(next_chunk_ + (next_in_chunk_ > 0 ? 1 : 0));
  if (next_in_chunk_ > 0) {
    // The bytes that remain stay in their place.
    chunks_.back().resize(next_in_chunk_);
    ++next_chunk_;
    next_in_chunk_ = 0;
  }
  end_ = next_;
  is_ended_ = is_end_sent_ = is_reset_ = true;
}

}  // namespace hairnet::quic
