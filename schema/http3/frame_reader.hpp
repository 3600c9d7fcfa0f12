#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "schema/http3/varint.hpp"

namespace hairnet::http3 {

// Cuts a byte stream into frames: type, length, payload. Capsules (RFC 9297) have the same form. It keeps no payload:
// it passes it on in the pieces that arrive.
class FrameReader {
 public:
  struct Piece {
    std::uint64_t type = 0;
    // Is the length of the whole payload.
    std::uint64_t length = 0;
    std::span<const std::uint8_t> bytes;
    bool is_first = false, is_last = false;
  };

  // Calls `on_piece` at least once for each frame whose header is complete. Stops when it returns false, and drops the
  // rest.
  void feed(std::span<const std::uint8_t> bytes, const std::function<bool(const Piece&)>& on_piece);
  // Whether the stream may end here.
  [[nodiscard]] bool is_between_frames() const { return header_bytes_ == 0 && !in_payload_; }

 private:
  // Takes a byte of the header. True when it is complete.
  bool take_header(std::uint8_t byte);

  std::array<std::uint8_t, 2 * kVarintBytesMax> header_{};
  std::size_t header_bytes_ = 0;
  // `left_` counts the bytes of the payload that have not come yet.
  std::uint64_t type_ = 0, length_ = 0, left_ = 0;
  bool in_payload_ = false;
};

}  // namespace hairnet::http3
