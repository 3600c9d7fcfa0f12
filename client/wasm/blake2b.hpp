#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace hairnet::wasm {

// BLAKE2b of 32 bytes without a key (RFC 7693), of bytes that come in pieces. It has no other lengths and no keyed
// mode, since only files are named by it.
class Blake2b {
 public:
  Blake2b();
  void add(std::span<const std::uint8_t> piece);
  // Covers all pieces so far.
  [[nodiscard]] std::array<std::uint8_t, 32> hash() const;

 private:
  using Words = std::array<std::uint64_t, 8>;
  // Returns the state after the block.
  [[nodiscard]] Words mixed(bool is_last) const;

  Words state_;
  std::array<std::uint8_t, 128> block_{};
  // The number of bytes of all pieces.
  std::uint64_t byte_count_ = 0;
  // The number of bytes of the block, which is mixed in when more bytes follow.
  std::uint32_t filled_ = 0;
};

}  // namespace hairnet::wasm
