// What schema/bytes promises, by functions of our own instead of libsodium and zlib.
#include <new>

#include "client/wasm/blake2b.hpp"
#include "client/wasm/deflate.hpp"
#include "client/wasm/inflate.hpp"
#include "schema/bytes/content_hash.hpp"

namespace hairnet::bytes {

ContentHasher::ContentHasher() {
  static_assert(sizeof(wasm::Blake2b) <= kStateBytes && alignof(wasm::Blake2b) <= 64);
  new (state_.data()) wasm::Blake2b;
}

void ContentHasher::add(std::span<const std::uint8_t> piece) {
  std::launder(reinterpret_cast<wasm::Blake2b*>(state_.data()))->add(piece);
}

ContentHash ContentHasher::hash() const {
  return std::launder(reinterpret_cast<const wasm::Blake2b*>(state_.data()))->hash();
}

// There is one effort here: these modules have no code for matches, which the planes of our files hardly have.
std::vector<std::uint8_t> deflated(std::span<const std::uint8_t> bytes, PackEffort) {
  return wasm::deflated(bytes);
}

InflateError inflate_into(std::span<const std::uint8_t> stream, std::span<std::uint8_t> out) {
  return wasm::inflate_into(stream, out);
}

}  // namespace hairnet::bytes
