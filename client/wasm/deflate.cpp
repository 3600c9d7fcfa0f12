#include "client/wasm/deflate.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <queue>
#include <utility>

#include "client/wasm/deflate_format.hpp"

namespace hairnet::wasm {
namespace {

// Each block has codes of its own. Planes of numbers change along a file, so one code for all would fit none; smaller
// blocks spend more on the lengths of codes.
constexpr std::size_t kBlockBytes = std::size_t{64} << 10;
constexpr std::size_t kSymbols = kEndOfBlock + 1;

using Lengths = std::array<std::uint8_t, kSymbols>;

// Bits, the lowest of each byte first.
class BitWriter {
 public:
  void put(std::uint32_t bits, std::uint32_t count) {
    held_ |= std::uint64_t{bits} << held_count_;
    held_count_ += count;
    for (; held_count_ >= 8; held_count_ -= 8, held_ >>= 8) out_.push_back(static_cast<std::uint8_t>(held_));
  }
  std::vector<std::uint8_t> finish() {
    put(0, (8 - held_count_) % 8);
    return std::move(out_);
  }

 private:
  std::vector<std::uint8_t> out_;
  std::uint64_t held_ = 0;
  std::uint32_t held_count_ = 0;
};

// The lengths of Huffman's code, or nothing if one is too long.
bool huffman_lengths(const std::array<std::uint32_t, kSymbols>& counts, Lengths& lengths) {
  using Tree = std::pair<std::uint64_t, std::size_t>;  // how often its symbols occur, and its node
  std::priority_queue<Tree, std::vector<Tree>, std::greater<>> trees;
  std::array<std::size_t, 2 * kSymbols> parent{};
  for (std::size_t s = 0; s < kSymbols; ++s) {
    if (counts[s] != 0) trees.emplace(counts[s], s);
  }
  std::size_t node = kSymbols;
  for (; trees.size() > 1; ++node) {
    const Tree a = trees.top();
    trees.pop();
    const Tree b = trees.top();
    trees.pop();
    parent[a.second] = parent[b.second] = node;
    trees.emplace(a.first + b.first, node);
  }
  lengths.fill(0);
  for (std::size_t s = 0; s < kSymbols; ++s) {
    if (counts[s] == 0) continue;
    std::uint32_t length = 0;
    // Node 0 is a symbol and never a parent, so 0 marks the root.
    for (std::size_t at = s; parent[at] != 0; at = parent[at]) ++length;
    if (length > kCodeBitsMax) return false;
    lengths[s] = static_cast<std::uint8_t>(length);
  }
  return true;
}

// A code of each symbol, its first bit lowest.
std::array<std::uint16_t, kSymbols> canonical_codes(const Lengths& lengths) {
  std::array<std::uint16_t, kCodeBitsMax + 2> next{};
  for (const std::uint8_t length : lengths) {
    if (length != 0) ++next[length + 1u];
  }
  for (std::size_t length = 1; length < next.size(); ++length)
    // The first code of each length follows the last one of the length before (RFC 1951, 3.2.2).
    next[length] = static_cast<std::uint16_t>((next[length] + next[length - 1]) * 2);
  std::array<std::uint16_t, kSymbols> codes{};
  for (std::size_t s = 0; s < kSymbols; ++s) {
    std::uint32_t code = lengths[s] == 0 ? 0 : next[lengths[s]]++;
    for (std::uint32_t bit = 0; bit < lengths[s]; ++bit, code >>= 1)
      codes[s] = static_cast<std::uint16_t>(codes[s] << 1 | (code & 1));
  }
  return codes;
}

// A block has its own codes, and the lengths of these codes in front (RFC 1951, 3.2.7).
void write_block(std::span<const std::uint8_t> bytes, bool is_last, BitWriter& to) {
  std::array<std::uint32_t, kSymbols> counts{};
  for (const std::uint8_t byte : bytes) ++counts[byte];
  counts[kEndOfBlock] = 1;
  if (bytes.empty()) counts[0] = 1;  // a code has two symbols at least
  Lengths lengths;
  while (!huffman_lengths(counts, lengths)) {
    // Halved counts are nearer to each other, so the longest codes get shorter. No count becomes 0. Limited codes are a
    // little longer than the best ones, which deflate's 15 bits make rare.
    for (std::uint32_t& count : counts) count = (count + 1) / 2;
  }
  to.put(is_last ? 1 : 0, 1);
  to.put(2, 2);                   // codes of its own
  to.put(0, 5);                   // 257 literals
  to.put(0, 5);                   // one distance, which has no code
  to.put(kLengthSymbols - 4, 4);  // The lengths themselves take four bits each, 0 to 15 in order; none is repeated.
  for (std::size_t code = 0; code < kLengthSymbols; ++code) to.put(code < 3 ? 0 : 4, 3);
  const auto reversed = [](std::uint32_t length) {
    return (length & 1) << 3 | (length & 2) << 1 | (length & 4) >> 1 | (length & 8) >> 3;
  };
  for (const std::uint8_t length : lengths) to.put(reversed(length), 4);
  to.put(0, 4);
  const std::array<std::uint16_t, kSymbols> codes = canonical_codes(lengths);
  for (const std::uint8_t byte : bytes) to.put(codes[byte], lengths[byte]);
  to.put(codes[kEndOfBlock], lengths[kEndOfBlock]);
}

}  // namespace

std::vector<std::uint8_t> deflated(std::span<const std::uint8_t> bytes) {
  BitWriter to;
  do {
    const std::size_t count = std::min(bytes.size(), kBlockBytes);
    write_block(bytes.first(count), count == bytes.size(), to);
    bytes = bytes.subspan(count);
  } while (!bytes.empty());
  return to.finish();
}

}  // namespace hairnet::wasm
