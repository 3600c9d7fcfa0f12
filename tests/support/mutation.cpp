#include "tests/support/mutation.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace hairnet::wire {
namespace {

void mutate_once(std::mt19937& random, std::vector<std::uint8_t>& bytes) {
  const std::size_t at = random() % bytes.size();
  // Decoders fail first at counts and offsets at the limits of 7, 16, 31 and 32 bits.
  static constexpr std::array<std::uint32_t, 8> kNasty{0, 1, 4, 0x7F, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF};
  switch (random() % 6) {
    case 0:
      bytes[at] ^= static_cast<std::uint8_t>(1u << random() % 8);
      break;
    case 1:
      bytes[at] = static_cast<std::uint8_t>(random());
      break;
    // This overwrites what may be a count or an offset.
    case 2: {
      const std::uint32_t word = random() % 2 ? kNasty[random() % kNasty.size()] : random() % 256;
      const std::size_t aligned = at / 4 * 4;
      if (aligned + 4 <= bytes.size()) std::memcpy(bytes.data() + aligned, &word, 4);
      break;
    }
    // This copies some bytes over others.
    case 3: {
      const std::size_t count = std::min<std::size_t>(random() % 32, bytes.size() - at);
      const std::size_t from = random() % (bytes.size() - count + 1);
      std::memmove(bytes.data() + at, bytes.data() + from, count);
      break;
    }
    case 4:
      bytes.resize(at + 1);
      break;
    default:
      bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), 1 + random() % 8, 0xA5);
      break;
  }
}

bool has_size_prefix(const std::vector<std::uint8_t>& bytes) {
  std::uint32_t counted = 0;
  if (bytes.size() < sizeof counted) return false;
  std::memcpy(&counted, bytes.data(), sizeof counted);
  return counted == bytes.size() - sizeof counted;
}

}  // namespace

std::vector<std::uint8_t> mutated(std::mt19937& random, std::vector<std::uint8_t> bytes) {
  const bool had_size_prefix = has_size_prefix(bytes);
  for (std::uint32_t n = 1 + random() % 4; n > 0; --n) mutate_once(random, bytes);
  // A wrong size prefix would hide all other damage, so seven of eight mutations get a right one again.
  if (had_size_prefix && bytes.size() >= 4 && random() % 8 != 0) {
    const auto counted = static_cast<std::uint32_t>(bytes.size() - 4);
    std::memcpy(bytes.data(), &counted, 4);
  }
  // A sanitizer sees a read past the end only where the memory ends with the bytes.
  bytes.shrink_to_fit();
  return bytes;
}

}  // namespace hairnet::wire
