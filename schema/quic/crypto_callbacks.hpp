#pragma once

#include <ngtcp2/ngtcp2.h>

namespace hairnet::quic {

// Returns the functions that ngtcp2 calls for TLS and randomness, which are the same at both ends. Each end adds its
// own.
ngtcp2_callbacks crypto_callbacks();

}  // namespace hairnet::quic
