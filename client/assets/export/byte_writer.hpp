#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace hairnet {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

// Collects little-endian numbers and text. It grows without limit; callers bound what they write. Numbers are not
// aligned.
class ByteWriter {
 public:
  template <class Number>
  requires std::is_arithmetic_v<Number> ByteWriter& put(Number value) {
    return put(std::as_bytes(std::span(&value, 1)));
  }
  ByteWriter& put(std::span<const std::byte> more) {
    bytes_.insert(bytes_.end(), more.begin(), more.end());
    return *this;
  }
  ByteWriter& text(std::string_view text) { return put(std::as_bytes(std::span(text))); }
  // Appends as many `filler` as make the size a multiple of `multiple`.
  ByteWriter& align(std::size_t multiple, char filler) {
    while (bytes_.size() % multiple != 0) bytes_.push_back(static_cast<std::byte>(filler));
    return *this;
  }

  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  void clear() { bytes_.clear(); }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace hairnet
