#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include <ngtcp2/ngtcp2.h>

namespace hairnet::quic {

// The bytes of a stream from when they are to be sent until the peer has acknowledged them. They stay where they are in
// memory, since QUIC sends them again from there.
class SendBuffer {
 public:
  // After end() this does nothing.
  void push(std::vector<std::uint8_t> bytes);
  void end() { is_ended_ = true; }

  // Lists the next unsent bytes in `into`, and returns how many pieces there are. Bytes that found no room may follow.
  [[nodiscard]] std::size_t peek(std::span<ngtcp2_vec> into) const;
  // Whether the pieces of that peek() reach the end of the stream.
  [[nodiscard]] bool reaches_end(std::span<const ngtcp2_vec> pieces) const;
  void mark_sent(std::size_t bytes, bool with_end);
  // Frees all bytes before `offset`, which the peer has.
  void acknowledge(std::uint64_t offset);
  // Ends the stream without its unsent bytes. Sent bytes stay until they are acknowledged or the stream is closed,
  // since QUIC may send them again.
  void reset();

  [[nodiscard]] bool has_unsent() const { return next_ < end_ || (is_ended_ && !is_end_sent_); }
  [[nodiscard]] std::size_t unsent_bytes() const { return static_cast<std::size_t>(end_ - next_); }
  // A stream that was reset counts as 0, since nobody waits for its bytes.
  [[nodiscard]] std::size_t kept_bytes() const { return is_reset_ ? 0 : static_cast<std::size_t>(end_ - begin_); }
  [[nodiscard]] bool is_done() const { return is_reset_ || (is_ended_ && is_end_sent_ && begin_ == end_); }

 private:
  // The bytes as push() took them. Acknowledged chunks are freed from the front.
  std::deque<std::vector<std::uint8_t>> chunks_;
  // The offset in the stream at which the first chunk begins.
  std::uint64_t begin_ = 0;
  // The offset in the stream of the first unsent byte.
  std::uint64_t next_ = 0;
  // The offset in the stream behind the last byte.
  std::uint64_t end_ = 0;
  // The chunk, and the place in it, of the first unsent byte.
  std::size_t next_chunk_ = 0, next_in_chunk_ = 0;
  bool is_ended_ = false, is_end_sent_ = false, is_reset_ = false;
};

}  // namespace hairnet::quic
