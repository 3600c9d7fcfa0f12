#pragma once

#include <cstddef>
#include <cstdint>

#include "schema/limits.hpp"

namespace hairnet::quic {

// The priority string of GnuTLS for TLS 1.3 alone, with the ciphers that QUIC has.
inline constexpr const char* kTlsPriorities =
    "NORMAL:-VERS-ALL:+VERS-TLS1.3:-CIPHER-ALL:+AES-128-GCM:+AES-256-GCM:+CHACHA20-POLY1305:-GROUP-ALL:+GROUP-X25519:"
    "+GROUP-SECP256R1:+GROUP-SECP384R1:%DISABLE_TLS13_COMPAT_MODE";

// The most bytes of a datagram's payload.
inline constexpr std::size_t kDatagramBytesMax = wire::kDatagramBytesMax;
// The largest DATAGRAM frame that our ends accept (max_datagram_frame_size).
inline constexpr std::uint64_t kDatagramFrameBytesMax = 1500;

}  // namespace hairnet::quic
