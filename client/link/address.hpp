#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace hairnet::link {

enum class Transport : std::uint8_t { tcp, tls, ws, wss };

// How a link's packets travel.
enum class TransportChoice : std::uint8_t {
  // They travel by WebTransport where server and network have it, else as the address says.
  automatic,
  // They travel by WebTransport, or the link fails.
  webtransport,
  // They travel as the address says.
  address,
};

// The address of a server, and the protocol to use. `/wt.json` of the same host and port says where WebTransport is.
struct Address {
  Transport transport = Transport::tcp;
  std::string host = "127.0.0.1";
  std::uint16_t port = 7420;
  // The path of the WebSocket.
  std::string path = "/ws";

  [[nodiscard]] bool encrypted() const { return transport == Transport::tls || transport == Transport::wss; }
  // Returns "HOST:PORT" as the request of a page or of a WebSocket names the server.
  [[nodiscard]] std::string authority() const { return authority_at(port); }
  // Does the same for another port of the host.
  [[nodiscard]] std::string authority_at(std::uint16_t other_port) const;
  [[nodiscard]] bool web_socket() const { return transport == Transport::ws || transport == Transport::wss; }
};

// How a server's certificate is checked.
struct TlsOptions {
  // A PEM file of the authorities that may sign; empty: the system's store.
  std::string ca_file;
  // Accepts any certificate: for a demo, never for users.
  bool insecure = false;
};

// Parses "HOST:PORT", "tcp://HOST:PORT", "tls://HOST:PORT", "ws://HOST:PORT/PATH" or "wss://HOST:PORT/PATH". The
// default port is 7420, and for ws and wss their own 80 and 443; the default path is /ws. An IPv6 address must be in
// brackets.
Result<Address> parse_address(std::string_view text);

// "auto", "webtransport" or "address".
Result<TransportChoice> parse_transport_choice(std::string_view text);

// The scheme of its addresses: "tcp", "tls", "ws" or "wss".
std::string_view to_string(Transport transport);

// In the form that parse_address accepts.
std::string to_string(const Address& address);

}  // namespace hairnet::link
