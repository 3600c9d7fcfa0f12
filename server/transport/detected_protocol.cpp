#include "server/transport/detected_protocol.hpp"

#include <algorithm>

namespace hairnet::server {
namespace {

// The type of TLS' first record, a handshake.
constexpr std::uint8_t kTlsHandshake = 0x16;
// Record versions are 3.1 to 3.4 for all versions of TLS.
constexpr std::uint8_t kTlsMajor = 3;

bool is_method_letter(std::uint8_t byte) {
  return byte >= 'A' && byte <= 'Z';
}

}  // namespace

DetectedProtocol detect_protocol(std::span<const std::uint8_t> first) {
  if (first.empty()) return DetectedProtocol::unknown;
  // A TLS record begins with its type, then the version 3.x. Each byte that does not fit makes it a size prefix.
  if (first[0] == kTlsHandshake) {
    if (first.size() > 1 && first[1] != kTlsMajor) return DetectedProtocol::packets;
    if (first.size() > 2) return first[2] >= 1 && first[2] <= 4 ? DetectedProtocol::tls : DetectedProtocol::packets;
    return DetectedProtocol::unknown;
  }
  // Four letters are enough: every method that this server answers has three or four of them, or begins with four.
  const std::span<const std::uint8_t> method = first.first(std::min(first.size(), kProtocolBytesMax));
  for (std::size_t i = 0; i < method.size(); ++i) {
    // A method of three letters, GET, is followed by a space.
    const bool ends = i == kProtocolBytesMax - 1 && method[i] == ' ';
    if (!is_method_letter(method[i]) && !ends) return DetectedProtocol::packets;
  }
  return method.size() == kProtocolBytesMax ? DetectedProtocol::http : DetectedProtocol::unknown;
}

}  // namespace hairnet::server
