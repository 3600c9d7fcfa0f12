#include "schema/bytes/content_hash.hpp"

#include <sodium/crypto_generichash.h>

#include <new>
#include <tuple>

namespace hairnet::bytes {

static_assert(std::tuple_size_v<ContentHash> == crypto_generichash_BYTES);
static_assert(sizeof(crypto_generichash_state) == 384 && alignof(crypto_generichash_state) <= 64);

ContentHasher::ContentHasher() {
  auto* state = new (state_.data()) crypto_generichash_state;
  // It fails only for sizes of hash or key out of range.
  crypto_generichash_init(state, nullptr, 0, std::tuple_size_v<ContentHash>);
}

void ContentHasher::add(std::span<const std::uint8_t> piece) {
  auto* state = std::launder(reinterpret_cast<crypto_generichash_state*>(state_.data()));
  crypto_generichash_update(state, piece.data(), piece.size());
}

ContentHash ContentHasher::hash() const {
  // Finishing a state changes it.
  ContentHasher copy = *this;
  ContentHash hash;
  auto* state = std::launder(reinterpret_cast<crypto_generichash_state*>(copy.state_.data()));
  crypto_generichash_final(state, hash.data(), hash.size());
  return hash;
}

}  // namespace hairnet::bytes
