#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "schema/quic/certificate_hash.hpp"

namespace hairnet::link {

inline constexpr std::string_view kWebTransportPage = "/wt.json";  // of the server's TCP port

// What that page says.
struct WebTransportPage {
  std::uint16_t port = 0;  // 0: the server has no WebTransport
  std::string path;
  // Of the certificates that it may show; none: they are signed by an authority.
  std::vector<quic::CertificateHash> hashes;
};

// One line for a text that is no such page.
Result<WebTransportPage> read_web_transport_page(std::string_view text);

}  // namespace hairnet::link
