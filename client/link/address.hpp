#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace hairnet::link {

enum class Transport : std::uint8_t { tcp, tls, ws, wss };

// Where a server is and how to speak to it.
struct Address {
  Transport transport = Transport::tcp;
  std::string host = "127.0.0.1";
  std::uint16_t port = 7420;
  std::string path = "/ws";  // of the WebSocket

  [[nodiscard]] bool encrypted() const { return transport == Transport::tls || transport == Transport::wss; }
  [[nodiscard]] bool web_socket() const { return transport == Transport::ws || transport == Transport::wss; }
};

// How a server's certificate is checked.
struct TlsOptions {
  std::string ca_file;    // PEM; empty: the system's store
  bool insecure = false;  // takes any certificate: for a demo, never for users
};

// "HOST:PORT", "tcp://HOST:PORT", "tls://HOST:PORT", "ws://HOST:PORT/PATH" or "wss://HOST:PORT/PATH". Without a port:
// 7420, and for the web's two their own 80 and 443; without a path: /ws. An IPv6 address stands in brackets.
Result<Address> parse_address(std::string_view text);

// As parse_address takes it.
std::string to_string(const Address& address);

}  // namespace hairnet::link
