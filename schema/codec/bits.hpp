#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/assert.hpp"

// Bits in the order of their use: the first bit of a stream is the lowest of its first byte, and a number's lowest bit
// comes first. The last byte is filled up with zeros.
namespace hairnet::codec {

// Writes bits to memory, buffered in a 64-bit word. The caller provides enough space (kWriterSlackBytes): the writer
// knows no end and checks none, since encoders know a bound of what they write.
class BitWriter {
 public:
  explicit BitWriter(std::uint8_t* out) : begin_(out), out_(out) { HAIRNET_ASSERT(out); }

  // Writes the low `count` bits of `bits`, 0 to 56; higher bits must be 0. Up to 7 bits of the calls before may wait in
  // the word, so 56 more is the most that 64 bits hold with a whole number of bytes.
  void put(std::uint64_t bits, unsigned count) {
    HAIRNET_VALIDATE(count <= 56);
    HAIRNET_VALIDATE((bits >> count) == 0);
    word_ |= bits << used_;
    used_ += count;
    flush();
  }

  [[nodiscard]] std::uint32_t bit_count() const { return static_cast<std::uint32_t>(8 * (out_ - begin_)) + used_; }

  // Returns the number of bytes written; do not use the writer afterwards.
  std::size_t finish() {
    HAIRNET_ASSERT(used_ <= 7);
    if (used_ > 0) *out_++ = static_cast<std::uint8_t>(word_);
    return static_cast<std::size_t>(out_ - begin_);
  }

 private:
  // Writes all eight bytes of the word and keeps the bits of the last, incomplete byte: up to 7 bytes past the end.
  void flush() {
    // This loop compiles to one store.
    for (unsigned b = 0; b < 8; ++b) out_[b] = static_cast<std::uint8_t>(word_ >> 8 * b);
    out_ += used_ >> 3;
    word_ >>= used_ & ~7u;
    used_ &= 7u;
  }

  std::uint8_t* begin_;
  std::uint8_t* out_;
  std::uint64_t word_ = 0;
  // How many bits of word_ are in use, at most 7 between calls.
  unsigned used_ = 0;
};

// Bytes that a BitWriter may touch beyond those it counts.
inline constexpr std::size_t kWriterSlackBytes = 8;

// Reads bits from bytes. Past the end it returns zeros, and beyond_end() is true: a decoder checks once for many reads,
// and is safe for any bytes.
class BitReader {
 public:
  explicit BitReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  // Returns the next 56 bits or more, lowest first, without advancing. A word of 64 bits is read from a byte boundary,
  // so up to 7 of its bits are behind the reader already.
  [[nodiscard]] std::uint64_t peek() const {
    const std::size_t at = bit_ >> 3;
    std::uint64_t word = 0;
    if (at + 8 <= bytes_.size()) [[likely]] {
      // This loop compiles to one load.
      for (unsigned b = 0; b < 8; ++b) word |= std::uint64_t{bytes_[at + b]} << 8 * b;
    } else {
      for (std::size_t b = 0; at + b < bytes_.size(); ++b) word |= std::uint64_t{bytes_[at + b]} << 8 * b;
    }
    return word >> (bit_ & 7);
  }
  // A skip may lead beyond the end: the caller asks beyond_end() once for many reads.
  void skip(unsigned count) { bit_ += count; }

  // Takes 0 to 56 bits.
  std::uint64_t take(unsigned count) {
    HAIRNET_VALIDATE(count <= 56);
    const std::uint64_t bits = peek() & ((std::uint64_t{1} << count) - 1);
    skip(count);
    return bits;
  }

  [[nodiscard]] bool beyond_end() const { return bit_ > 8 * bytes_.size(); }
  // Whether all bytes are used and the padding bits of the last byte are zero.
  [[nodiscard]] bool ends_here() const {
    return !beyond_end() && 8 * bytes_.size() - bit_ < 8 && ((bit_ & 7) == 0 || bytes_.back() >> (bit_ & 7) == 0);
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t bit_ = 0;
};

}  // namespace hairnet::codec
