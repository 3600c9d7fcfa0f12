#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "core/assert.hpp"

// Inputs for functions that must give the same bits in a module for WebAssembly as here, as bytes: named cases, one
// after the other.
namespace hairnet::same_bits {

using Bytes = std::vector<std::uint8_t>;

// Writes numbers as they lie in memory; both machines have the lowest byte first.
class Writer {
 public:
  template <class T>
  requires std::is_trivially_copyable_v<T> Writer& put(const T& value) {
    const auto* begin = reinterpret_cast<const std::uint8_t*>(&value);
    bytes_.insert(bytes_.end(), begin, begin + sizeof value);
    return *this;
  }
  Writer& put_block(std::span<const std::uint8_t> block) {
    put(static_cast<std::uint32_t>(block.size()));
    bytes_.insert(bytes_.end(), block.begin(), block.end());
    return *this;
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

// Reads what a Writer has written. It asserts that what it is asked for is there, since the bytes come from our own
// program. The spans that it returns point into the bytes that it reads.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  [[nodiscard]] bool is_at_end() const { return rest_.empty(); }
  template <class T>
  T take() {
    T value;
    std::memcpy(&value, next(sizeof value).data(), sizeof value);
    return value;
  }
  std::span<const std::uint8_t> take_block() { return next(take<std::uint32_t>()); }

 private:
  std::span<const std::uint8_t> next(std::size_t count) {
    HAIRNET_ASSERT(count <= rest_.size());
    const auto taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }
  std::span<const std::uint8_t> rest_;
};

// One call of the functions under test: `kind` says which function (groom, basis, learnt, session, levels), and `input`
// is the bytes that it gets.
struct Case {
  std::string kind, name;
  std::span<const std::uint8_t> input;
};
inline void put_case(Writer& to, std::string_view kind, std::string_view name, std::span<const std::uint8_t> input) {
  const auto text = [](std::string_view s) {
    return std::span(reinterpret_cast<const std::uint8_t*>(s.data()), s.size());
  };
  to.put_block(text(kind)).put_block(text(name)).put_block(input);
}
inline Case take_case(Reader& from) {
  const auto text = [](std::span<const std::uint8_t> s) {
    return std::string(reinterpret_cast<const char*>(s.data()), s.size());
  };
  Case one;
  one.kind = text(from.take_block());
  one.name = text(from.take_block());
  one.input = from.take_block();
  return one;
}

}  // namespace hairnet::same_bits
