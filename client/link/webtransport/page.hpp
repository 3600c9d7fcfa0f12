#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "schema/quic/certificate_hash.hpp"

namespace hairnet::link {

// The server's TCP port answers at this path.
inline constexpr std::string_view kWebTransportPage = "/wt.json";

// What that page says.
struct WebTransportPage {
  // Zero means that the server has no WebTransport.
  std::uint16_t port = 0;
  std::string path;
  // The hashes of the certificates that the server may show; empty: an authority has signed its certificate.
  std::vector<quic::CertificateHash> hashes;
};

// The error is one line: the text is no such page.
Result<WebTransportPage> read_web_transport_page(std::string_view text);

}  // namespace hairnet::link
