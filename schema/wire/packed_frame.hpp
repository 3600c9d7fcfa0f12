#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "schema/wire/server_messages.hpp"

// A frame as it lies between others in a FrameBatch and in a frame datagram: PROTOCOL.md, Frames. For
// server_messages.cpp and frame_datagram.cpp alone.
namespace hairnet::wire {

// Both write to `at`, and return the end of what they wrote. The caller provides the room that varint_bytes() and
// packed_bytes() count. `member_before` is the member of the frame before, or 0.
std::uint8_t* write_varint(std::uint64_t value, std::uint8_t* at);
std::uint8_t* write_frame(const Frame& frame, std::uint32_t member_before, std::uint8_t* at);

std::size_t varint_bytes(std::uint64_t value);
std::size_t packed_bytes(const Frame& frame, std::uint32_t member_before);

// Takes integers and bytes off the front of a span. Each function returns false at the end of the span, or when an
// integer is not valid.
class Unpacker {
 public:
  explicit Unpacker(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  bool take(std::uint8_t& value) {
    if (bytes_.empty()) return false;
    value = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return true;
  }
  // The shift bounds the loop to 5 bytes for 32 bits and 10 for 64. A number that is written with more bytes than it
  // needs is accepted.
  template <class Unsigned>
  bool take_varint(Unsigned& value) {
    Unsigned sum = 0;
    for (int shift = 0; shift < std::numeric_limits<Unsigned>::digits; shift += 7) {
      std::uint8_t byte = 0;
      if (!take(byte)) return false;
      const Unsigned bits = byte & 0x7fu;
      // A last group whose bits do not fit the type is refused, not cut off.
      if (bits << shift >> shift != bits) return false;
      sum |= bits << shift;
      if (byte & 0x80) continue;
      value = sum;
      return true;
    }
    return false;
  }
  bool take(std::size_t count, std::span<const std::uint8_t>& out) {
    if (count > bytes_.size()) return false;
    out = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return true;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

// The frame's content is not copied: it lies in the bytes that `in` reads. Returns an empty string, or one line about
// what is wrong.
std::string read_frame(Unpacker& in, std::uint32_t member_before, Frame& out);

}  // namespace hairnet::wire
