#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace hairnet::wasm {

// BLAKE2b of 32 bytes without a key (RFC 7693), of bytes that come in pieces.
class Blake2b {
 public:
  Blake2b();
  void add(std::span<const std::uint8_t> piece);
  [[nodiscard]] std::array<std::uint8_t, 32> hash() const;  // of all pieces so far

 private:
  using Words = std::array<std::uint64_t, 8>;
  [[nodiscard]] Words mixed(bool is_last) const;  // the state after the block

  Words state_;
  std::array<std::uint8_t, 128> block_{};
  std::uint64_t byte_count_ = 0;  // of all pieces
  std::uint32_t filled_ = 0;      // of the block, which is mixed in when more bytes follow
};

}  // namespace hairnet::wasm
