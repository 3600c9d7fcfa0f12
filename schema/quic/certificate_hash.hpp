#pragma once

#include <array>
#include <cstdint>

namespace hairnet::quic {

using CertificateHash = std::array<std::uint8_t, 32>;  // SHA-256 of a certificate in DER

}  // namespace hairnet::quic
