#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace hairnet::bytes {

// BLAKE2b of 32 bytes, without a key. Files are named by it.
using ContentHash = std::array<std::uint8_t, 32>;

// The hash of bytes that come in pieces.
class ContentHasher {
 public:
  ContentHasher();
  void add(std::span<const std::uint8_t> piece);
  // The hash of all pieces so far.
  [[nodiscard]] ContentHash hash() const;

 private:
  static constexpr std::size_t kStateBytes = 384;
  // The bytes of libsodium's crypto_generichash_state, so that users of this header need no header of libsodium.
  alignas(64) std::array<std::uint8_t, kStateBytes> state_;
};

}  // namespace hairnet::bytes
