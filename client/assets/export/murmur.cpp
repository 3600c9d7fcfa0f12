#include "client/assets/export/murmur.hpp"

#include <bit>
#include <cstring>

// The algorithm is Austin Appleby's, in the public domain.
namespace hairnet {
namespace {

constexpr std::uint64_t kFactor1 = 0x87c37b91114253d5, kFactor2 = 0x4cf5ad432745937f;
constexpr std::size_t kBlockBytes = 16;

// Mixes one word of a block. The constants are the algorithm's and must not be changed: digests in files of other
// programs depend on them.
std::uint64_t mixed(std::uint64_t word, std::uint64_t first, int turn, std::uint64_t second) {
  return std::rotl(word * first, turn) * second;
}

// Spreads each bit over the whole word (Murmur's finaliser).
std::uint64_t spread(std::uint64_t h) {
  h = (h ^ h >> 33) * 0xff51afd7ed558ccd;
  h = (h ^ h >> 33) * 0xc4ceb9fe1a85ec53;
  return h ^ h >> 33;
}

}  // namespace

MurmurDigest murmur_128(std::span<const std::byte> bytes) {
  std::uint64_t h1 = 0, h2 = 0;
  std::array<std::uint64_t, 2> block;
  std::size_t at = 0;
  for (; bytes.size() - at >= kBlockBytes; at += kBlockBytes) {
    std::memcpy(block.data(), bytes.data() + at, kBlockBytes);
    h1 = (std::rotl(h1 ^ mixed(block[0], kFactor1, 31, kFactor2), 27) + h2) * 5 + 0x52dce729;
    h2 = (std::rotl(h2 ^ mixed(block[1], kFactor2, 33, kFactor1), 31) + h1) * 5 + 0x38495ab5;
  }
  // The rest is a block that zeros fill up.
  block = {};
  if (at < bytes.size()) std::memcpy(block.data(), bytes.data() + at, bytes.size() - at);
  h1 ^= mixed(block[0], kFactor1, 31, kFactor2) ^ bytes.size();
  h2 ^= mixed(block[1], kFactor2, 33, kFactor1) ^ bytes.size();
  h1 += h2;
  h2 += h1;
  h1 = spread(h1);
  h2 = spread(h2);
  h1 += h2;
  return {h1, h2 + h1};
}

}  // namespace hairnet
