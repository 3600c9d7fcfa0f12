#include "client/wasm/blake2b.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>

namespace hairnet::wasm {
namespace {

static_assert(std::endian::native == std::endian::little, "words are copied as they lie in memory");

// The initial values of RFC 7693, section 2.6.
constexpr std::array<std::uint64_t, 8> kInitial{0x6a09e667f3bcc908, 0xbb67ae8584caa73b, 0x3c6ef372fe94f82b,
                                                0xa54ff53a5f1d36f1, 0x510e527fade682d1, 0x9b05688c2b3e6c1f,
                                                0x1f83d9abfb41bd6b, 0x5be0cd19137e2179};
// The parameters are one leaf, no key, and a hash of 32 bytes (RFC 7693, 2.5).
constexpr std::uint64_t kParameters = 0x01010000 + 32;

// The word of the block that each step of a round takes (sigma of RFC 7693, 2.7); rounds 10 and 11 repeat the first
// two.
constexpr std::array<std::array<std::uint8_t, 16>, 10> kOrder{{
    {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},
    {14, 10, 4, 8, 9, 15, 13, 6, 1, 12, 0, 2, 11, 7, 5, 3},
    {11, 8, 12, 0, 5, 2, 15, 13, 10, 14, 3, 6, 7, 1, 9, 4},
    {7, 9, 3, 1, 13, 12, 11, 14, 2, 6, 5, 10, 4, 0, 15, 8},
    {9, 0, 5, 7, 2, 4, 10, 15, 14, 1, 11, 12, 6, 8, 3, 13},
    {2, 12, 6, 10, 0, 11, 8, 3, 4, 13, 7, 5, 15, 14, 1, 9},
    {12, 5, 1, 15, 14, 13, 4, 10, 0, 7, 6, 3, 9, 2, 8, 11},
    {13, 11, 7, 14, 12, 1, 3, 9, 5, 0, 15, 4, 8, 6, 2, 10},
    {6, 15, 14, 9, 11, 3, 0, 8, 12, 2, 13, 7, 1, 4, 10, 5},
    {10, 2, 8, 4, 7, 6, 1, 5, 15, 11, 9, 14, 3, 12, 13, 0},
}};
constexpr int kRounds = 12;

// The mixing function G of RFC 7693, section 3.1, with the rotations of section 2.1.
void mix(std::uint64_t& a, std::uint64_t& b, std::uint64_t& c, std::uint64_t& d, std::uint64_t x, std::uint64_t y) {
  a += b + x;
  d = std::rotr(d ^ a, 32);
  c += d;
  b = std::rotr(b ^ c, 24);
  a += b + y;
  d = std::rotr(d ^ a, 16);
  c += d;
  b = std::rotr(b ^ c, 63);
}

}  // namespace

Blake2b::Blake2b() : state_(kInitial) {
  state_[0] ^= kParameters;
}

void Blake2b::add(std::span<const std::uint8_t> piece) {
  while (!piece.empty()) {
    // A full block is mixed only when more bytes come: the last block is mixed in another way.
    if (filled_ == block_.size()) {
      state_ = mixed(false);
      filled_ = 0;
    }
    const std::size_t taken = std::min(piece.size(), block_.size() - filled_);
    std::memcpy(block_.data() + filled_, piece.data(), taken);
    filled_ += static_cast<std::uint32_t>(taken);
    byte_count_ += taken;
    piece = piece.subspan(taken);
  }
}

std::array<std::uint8_t, 32> Blake2b::hash() const {
  Blake2b last = *this;
  // The last block is filled up with zeros; the count of bytes tells them from data.
  std::fill(last.block_.begin() + filled_, last.block_.end(), std::uint8_t{0});
  const Words words = last.mixed(true);
  std::array<std::uint8_t, 32> hash;
  std::memcpy(hash.data(), words.data(), hash.size());
  return hash;
}

// The compression function F of RFC 7693, section 3.2. Returns the next state, and changes nothing.
Blake2b::Words Blake2b::mixed(bool is_last) const {
  std::array<std::uint64_t, 16> m, v;
  std::memcpy(m.data(), block_.data(), sizeof m);
  std::copy(state_.begin(), state_.end(), v.begin());
  std::copy(kInitial.begin(), kInitial.end(), v.begin() + 8);
  // The count has 128 bits in RFC 7693; its upper word stays zero, as nobody hashes 2^64 bytes.
  v[12] ^= byte_count_;
  // The inverted word is the flag of the last block.
  if (is_last) v[14] = ~v[14];
  for (int round = 0; round < kRounds; ++round) {
    const auto& order = kOrder[static_cast<std::size_t>(round) % kOrder.size()];
    for (std::size_t i = 0; i < 4; ++i) mix(v[i], v[4 + i], v[8 + i], v[12 + i], m[order[2 * i]], m[order[2 * i + 1]]);
    for (std::size_t i = 0; i < 4; ++i)
      mix(v[i], v[4 + (i + 1) % 4], v[8 + (i + 2) % 4], v[12 + (i + 3) % 4], m[order[8 + 2 * i]], m[order[9 + 2 * i]]);
  }
  Words out = state_;
  for (std::size_t i = 0; i < out.size(); ++i) out[i] ^= v[i] ^ v[8 + i];
  return out;
}

}  // namespace hairnet::wasm
