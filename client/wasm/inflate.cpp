#include "client/wasm/inflate.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

#include "client/wasm/deflate_format.hpp"

namespace hairnet::wasm {
namespace {

using bytes::InflateError;

constexpr int kFastBits = 10;  // codes up to this length are found in one look
constexpr std::size_t kLiteralCodes = 288, kDistanceCodes = 32;
// The number of codes that a stream may use. The last two of each alphabet are there only to make the fixed codes
// complete.
constexpr std::uint32_t kLiteralCodesUsed = 286, kDistanceCodesUsed = 30;

// The tables of RFC 1951, 3.2.5: for each code, the shortest match or distance, and the number of further bits, which
// are added to it.
constexpr std::array<std::uint16_t, 29> kLengthBase{3,  4,  5,  6,  7,  8,  9,  10, 11,  13,  15,  17,  19,  23, 27,
                                                    31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258};
constexpr std::array<std::uint8_t, 29> kLengthBits{0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2,
                                                   2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0};
constexpr std::array<std::uint16_t, 30> kDistanceBase{1,    2,    3,    4,    5,    7,    9,    13,    17,    25,
                                                      33,   49,   65,   97,   129,  193,  257,  385,   513,   769,
                                                      1025, 1537, 2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577};
constexpr std::array<std::uint8_t, 30> kDistanceBits{0, 0, 0, 0, 1, 1, 2, 2,  3,  3,  4,  4,  5,  5,  6,
                                                     6, 7, 7, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13};
// The order in which a block gives the lengths of the codes of its code lengths.
constexpr std::array<std::uint8_t, kLengthSymbols> kLengthOrder{16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                                                11, 4,  12, 3, 13, 2, 14, 1, 15};

// Bits, the lowest of each byte first. Past the end they are zero, and taking them is an overrun.
class Bits {
 public:
  explicit Bits(std::span<const std::uint8_t> stream) : at_(stream.data()), end_(stream.data() + stream.size()) {}

  // Brings at least 56 bits into view, fewer only at the end of the stream.
  void refill() {
    if (end_ - at_ >= 8) {
      std::uint64_t next;
      std::memcpy(&next, at_, sizeof next);
      view_ |= next << count_;
      // Takes as many whole bytes as fit. The bits above count_ belong to the next byte, which the next refill brings
      // again at the same place.
      at_ += (63 - count_) / 8;
      count_ |= 56;
      return;
    }
    while (count_ <= 56 && at_ != end_) {
      view_ |= std::uint64_t{*at_++} << count_;
      count_ += 8;
    }
  }
  [[nodiscard]] std::uint32_t look() const { return static_cast<std::uint32_t>(view_); }
  // False at the end of the stream.
  [[nodiscard]] bool drop(int count) {
    if (count > count_) return false;
    view_ >>= count;
    count_ -= count;
    return true;
  }
  // At most 16 bits, of those in view.
  [[nodiscard]] bool take(int count, std::uint32_t& out) {
    out = look() & ((1u << count) - 1);
    return drop(count);
  }
  // Leaves the rest of a byte, and takes whole bytes.
  [[nodiscard]] bool take_bytes(std::span<std::uint8_t> out) {
    // Whole bytes that are in view go back to the stream; the rest of the byte in use is padding.
    at_ -= count_ / 8;
    view_ = 0;
    count_ = 0;
    if (static_cast<std::size_t>(end_ - at_) < out.size()) return false;
    if (!out.empty()) std::memcpy(out.data(), at_, out.size());
    at_ += out.size();
    return true;
  }
  // Whether no whole byte is left.
  [[nodiscard]] bool is_at_end() const { return at_ == end_ && count_ < 8; }

 private:
  const std::uint8_t *at_, *end_;
  std::uint64_t view_ = 0;
  int count_ = 0;  // in view. Bits of view_ beyond it are zero, or those that the next refill brings again
};
static_assert(std::endian::native == std::endian::little, "eight bytes are read as a number");

struct Symbol {
  int value;  // -1: no code begins like this
  int bits;
};

// A prefix code, from the lengths of its codes.
class PrefixCode {
 public:
  // False if the lengths make no code. `may_lack`: a lone code of one bit will do.
  [[nodiscard]] bool build(std::span<const std::uint8_t> lengths, bool may_lack) {
    count_.fill(0);
    fast_.fill(0);
    for (const std::uint8_t length : lengths) ++count_[length];
    count_[0] = 0;
    int left = 1, used = 0;
    std::array<std::uint16_t, kCodeBitsMax + 2> index{}, code{};
    for (std::size_t length = 1; length <= kCodeBitsMax; ++length) {
      // `left` counts the codes of this length that no shorter code has used up. Below 0 the lengths are more than a
      // tree has room for.
      left = 2 * left - count_[length];
      if (left < 0) return false;
      used += count_[length];
      index[length + 1] = static_cast<std::uint16_t>(index[length] + count_[length]);
      code[length + 1] = static_cast<std::uint16_t>((code[length] + count_[length]) << 1);
    }
    // Without codes every bit is wrong, but a block of literals alone has no use for distances.
    if (left > 0 && used > 0 && !(may_lack && used == 1 && count_[1] == 1)) return false;
    for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol) {
      const int length = lengths[symbol];
      if (length == 0) continue;
      const auto l = static_cast<std::size_t>(length);
      symbols_[index[l]++] = static_cast<std::uint16_t>(symbol);
      const std::uint32_t reversed = reverse(code[l]++, length);
      if (length > kFastBits) continue;
      const auto entry = static_cast<std::uint16_t>(symbol << 4 | l);
      // The bits behind a short code may be any, so it fills every entry that ends in its bits.
      for (std::size_t i = reversed; i < fast_.size(); i += std::size_t{1} << length) fast_[i] = entry;
    }
    return true;
  }

  [[nodiscard]] Symbol find(std::uint32_t bits) const {
    const std::uint16_t entry = fast_[bits % fast_.size()];
    if (entry != 0) return {entry >> 4, entry & 15};
    int code = 0, first = 0, index = 0;
    for (int length = 1; length <= static_cast<int>(kCodeBitsMax); ++length, bits >>= 1) {
      code |= static_cast<int>(bits & 1);
      const int count = count_[static_cast<std::size_t>(length)];
      // Codes of one length are consecutive numbers in the order of their symbols, `first` being the lowest.
      if (code - first < count) return {symbols_[static_cast<std::size_t>(index + code - first)], length};
      index += count;
      first = (first + count) << 1;
      code <<= 1;
    }
    return {-1, 1};
  }

 private:
  static std::uint32_t reverse(std::uint32_t code, int length) {
    std::uint32_t out = 0;
    for (int i = 0; i < length; ++i, code >>= 1) out = out << 1 | (code & 1);
    return out;
  }

  // For each value of the next kFastBits bits: a symbol and the length of its code; zero means a longer code, or none.
  std::array<std::uint16_t, std::size_t{1} << kFastBits> fast_;
  // The number of codes with each length.
  std::array<std::uint16_t, kCodeBitsMax + 1> count_;
  // The symbols in the order of their codes.
  std::array<std::uint16_t, kLiteralCodes> symbols_;
};

class Inflater {
 public:
  Inflater(std::span<const std::uint8_t> stream, std::span<std::uint8_t> out) : bits_(stream), out_(out) {}

  InflateError run() {
    std::uint32_t is_last = 0;
    while (is_last == 0) {
      std::uint32_t type = 0;
      bits_.refill();
      if (!bits_.take(1, is_last) || !bits_.take(2, type)) return InflateError::wrong_length;
      InflateError error = InflateError::damaged;
      if (type == 0) error = stored_block();
      if (type == 1) error = fixed_block();
      if (type == 2) error = dynamic_block();
      if (error != InflateError::none) return error;
    }
    return written_ == out_.size() && bits_.is_at_end() ? InflateError::none : InflateError::wrong_length;
  }

 private:
  InflateError stored_block() {
    std::array<std::uint8_t, 4> header;
    if (!bits_.take_bytes(header)) return InflateError::wrong_length;
    const std::size_t count = header[0] | std::size_t{header[1]} << 8;
    // A stored block gives its length twice, the second time inverted.
    if ((count ^ 0xffff) != (header[2] | std::size_t{header[3]} << 8)) return InflateError::damaged;
    if (count > out_.size() - written_ || !bits_.take_bytes(out_.subspan(written_, count)))
      return InflateError::wrong_length;
    written_ += count;
    return InflateError::none;
  }

  InflateError fixed_block() {
    std::array<std::uint8_t, kLiteralCodes> literals;
    std::fill(literals.begin(), literals.begin() + 144, std::uint8_t{8});
    std::fill(literals.begin() + 144, literals.begin() + 256, std::uint8_t{9});
    std::fill(literals.begin() + 256, literals.begin() + 280, std::uint8_t{7});
    std::fill(literals.begin() + 280, literals.end(), std::uint8_t{8});
    std::array<std::uint8_t, kDistanceCodes> distances;
    distances.fill(5);
    if (!literals_.build(literals, false) || !distances_.build(distances, false)) return InflateError::damaged;
    return symbols();
  }

  InflateError dynamic_block() {
    std::uint32_t literal_count = 0, distance_count = 0, length_count = 0;
    bits_.refill();
    if (!bits_.take(5, literal_count) || !bits_.take(5, distance_count) || !bits_.take(4, length_count))
      return InflateError::wrong_length;
    literal_count += 257;
    distance_count += 1;
    length_count += 4;
    if (literal_count > kLiteralCodesUsed || distance_count > kDistanceCodesUsed) return InflateError::damaged;
    std::array<std::uint8_t, kLengthSymbols> of_lengths{};
    for (std::size_t i = 0; i < length_count; ++i) {
      std::uint32_t length = 0;
      bits_.refill();
      if (!bits_.take(3, length)) return InflateError::wrong_length;
      of_lengths[kLengthOrder[i]] = static_cast<std::uint8_t>(length);
    }
    // The code of the lengths borrows the table of literals, which is built again below.
    if (!literals_.build(of_lengths, false)) return InflateError::damaged;
    std::array<std::uint8_t, kLiteralCodes + kDistanceCodes> storage;
    const auto lengths = std::span(storage).first(literal_count + distance_count);
    if (const InflateError error = code_lengths(lengths); error != InflateError::none) return error;
    // Without a code for its end a block could only end by an error.
    if (lengths[kEndOfBlock] == 0) return InflateError::damaged;
    if (!literals_.build(lengths.first(literal_count), true) || !distances_.build(lengths.subspan(literal_count), true))
      return InflateError::damaged;
    return symbols();
  }

  // Run-length coded: 16 repeats the last one, 17 and 18 are zeros.
  InflateError code_lengths(std::span<std::uint8_t> out) {
    for (std::size_t i = 0; i < out.size();) {
      bits_.refill();
      const Symbol symbol = literals_.find(bits_.look());
      if (!bits_.drop(symbol.bits)) return InflateError::wrong_length;
      if (symbol.value < 0) return InflateError::damaged;
      if (symbol.value < 16) {
        out[i++] = static_cast<std::uint8_t>(symbol.value);
        continue;
      }
      std::uint32_t more = 0;
      if (!bits_.take(symbol.value == 16 ? 2 : symbol.value == 17 ? 3 : 7, more)) return InflateError::wrong_length;
      const std::size_t count = more + (symbol.value == 18 ? 11 : 3);
      if ((symbol.value == 16 && i == 0) || count > out.size() - i) return InflateError::damaged;
      const std::uint8_t repeated = symbol.value == 16 ? out[i - 1] : std::uint8_t{0};
      std::fill_n(out.begin() + static_cast<std::ptrdiff_t>(i), count, repeated);
      i += count;
    }
    return InflateError::none;
  }

  // Literals and matches, to the end of the block.
  InflateError symbols() {
    for (;;) {
      bits_.refill();  // the longest literal or match takes 48 bits
      const Symbol symbol = literals_.find(bits_.look());
      if (!bits_.drop(symbol.bits)) return InflateError::wrong_length;
      if (symbol.value < 0) return InflateError::damaged;
      const auto value = static_cast<std::size_t>(symbol.value);
      if (value == kEndOfBlock) return InflateError::none;
      if (value > kEndOfBlock) {
        if (const InflateError error = match(value - kEndOfBlock - 1); error != InflateError::none) return error;
        continue;
      }
      if (written_ == out_.size()) return InflateError::wrong_length;
      out_[written_++] = static_cast<std::uint8_t>(value);
    }
  }

  InflateError match(std::size_t length_code) {
    if (length_code >= kLengthBase.size()) return InflateError::damaged;
    std::uint32_t more = 0;
    if (!bits_.take(kLengthBits[length_code], more)) return InflateError::wrong_length;
    const std::size_t length = kLengthBase[length_code] + more;
    const Symbol code = distances_.find(bits_.look());
    if (!bits_.drop(code.bits)) return InflateError::wrong_length;
    if (code.value < 0 || code.value >= static_cast<int>(kDistanceBase.size())) return InflateError::damaged;
    const auto distance_code = static_cast<std::size_t>(code.value);
    if (!bits_.take(kDistanceBits[distance_code], more)) return InflateError::wrong_length;
    const std::size_t distance = kDistanceBase[distance_code] + more;
    if (written_ == out_.size()) return InflateError::wrong_length;
    // A distance beyond the first byte would read memory that is not ours.
    if (distance > written_) return InflateError::damaged;
    if (length > out_.size() - written_) return InflateError::wrong_length;
    // One by one, because a match may reach into itself.
    std::uint8_t* to = out_.data() + written_;
    for (std::size_t i = 0; i < length; ++i, ++to) *to = *(to - distance);
    written_ += length;
    return InflateError::none;
  }

  Bits bits_;
  std::span<std::uint8_t> out_;
  std::size_t written_ = 0;
  PrefixCode literals_, distances_;
};

}  // namespace

InflateError inflate_into(std::span<const std::uint8_t> stream, std::span<std::uint8_t> out) {
  return Inflater(stream, out).run();
}

}  // namespace hairnet::wasm
