#include "schema/quic/crypto_callbacks.hpp"

#include <gnutls/crypto.h>
#include <ngtcp2/ngtcp2_crypto.h>

namespace hairnet::quic {
namespace {

void put_random(std::uint8_t* out, std::size_t bytes, const ngtcp2_rand_ctx*) {
  gnutls_rnd(GNUTLS_RND_NONCE, out, bytes);
}

}  // namespace

ngtcp2_callbacks crypto_callbacks() {
  ngtcp2_callbacks made{};
  made.recv_crypto_data = ngtcp2_crypto_recv_crypto_data_cb;
  made.encrypt = ngtcp2_crypto_encrypt_cb;
  made.decrypt = ngtcp2_crypto_decrypt_cb;
  made.hp_mask = ngtcp2_crypto_hp_mask_cb;
  made.update_key = ngtcp2_crypto_update_key_cb;
  made.delete_crypto_aead_ctx = ngtcp2_crypto_delete_crypto_aead_ctx_cb;
  made.delete_crypto_cipher_ctx = ngtcp2_crypto_delete_crypto_cipher_ctx_cb;
  made.get_path_challenge_data = ngtcp2_crypto_get_path_challenge_data_cb;
  made.version_negotiation = ngtcp2_crypto_version_negotiation_cb;
  made.rand = put_random;
  return made;
}

}  // namespace hairnet::quic
