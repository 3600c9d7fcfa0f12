#pragma once

#include <array>
#include <cstdint>

namespace hairnet::quic {

// The SHA-256 of a certificate in DER.
using CertificateHash = std::array<std::uint8_t, 32>;

}  // namespace hairnet::quic
