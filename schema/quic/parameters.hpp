#pragma once

#include <cstddef>
#include <cstdint>

#include "schema/limits.hpp"

namespace hairnet::quic {

// In the form of GnuTLS: TLS 1.3 alone, with the ciphers that QUIC has.
inline constexpr const char* kTlsPriorities =
    "NORMAL:-VERS-ALL:+VERS-TLS1.3:-CIPHER-ALL:+AES-128-GCM:+AES-256-GCM:+CHACHA20-POLY1305:-GROUP-ALL:+GROUP-X25519:"
    "+GROUP-SECP256R1:+GROUP-SECP384R1:%DISABLE_TLS13_COMPAT_MODE";

// A payload of a datagram has at most so many bytes.
inline constexpr std::size_t kDatagramBytesMax = wire::kDatagramBytesMax;
// Our ends accept DATAGRAM frames of at most so many bytes (max_datagram_frame_size).
inline constexpr std::uint64_t kDatagramFrameBytesMax = 1500;

}  // namespace hairnet::quic
