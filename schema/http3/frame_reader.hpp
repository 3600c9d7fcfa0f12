#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "schema/http3/varint.hpp"

namespace hairnet::http3 {

// Cuts a byte stream into frames of type, length and payload. Capsules (RFC 9297) have the same form. The reader keeps
// no payload: it passes the payload on in the pieces that arrive.
class FrameReader {
 public:
  struct Piece {
    std::uint64_t type = 0;
    // The length of the whole payload.
    std::uint64_t length = 0;
    std::span<const std::uint8_t> bytes;
    bool is_first = false, is_last = false;
  };

  // Calls `on_piece` at least once for each frame whose header is complete. When `on_piece` returns false, the reader
  // stops and drops the rest of `bytes`.
  void feed(std::span<const std::uint8_t> bytes, const std::function<bool(const Piece&)>& on_piece);
  // Whether the stream may end here.
  [[nodiscard]] bool is_between_frames() const { return header_bytes_ == 0 && !in_payload_; }

 private:
  // Takes one byte of the header. True when the header is complete.
  bool take_header(std::uint8_t byte);

  // The bytes of an incomplete header.
  std::array<std::uint8_t, 2 * kVarintBytesMax> header_{};
  std::size_t header_bytes_ = 0;
  // The current frame, once its header is complete. `left_` counts the bytes of its payload that have not come yet.
  std::uint64_t type_ = 0, length_ = 0, left_ = 0;
  bool in_payload_ = false;
};

}  // namespace hairnet::http3
