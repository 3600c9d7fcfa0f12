#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/transport/admission.hpp"

namespace hairnet::server {

// PEM files: the chain, the server's own certificate first, and its key without a passphrase. Both or none.
struct TlsFiles {
  std::string certificate, key;
};

// The settings of one port: addresses, TLS, pages, limits and timeouts.
struct TransportOptions {
  // Each is IPv4 or IPv6, numeric or localhost; "::" is all.
  std::vector<std::string> addresses = {"127.0.0.1"};
  // Zero lets the system pick one.
  std::uint16_t port = 7420;

  // WebTransport has a UDP port: zero is the number of the TCP port.
  bool webtransport = true;
  std::uint16_t udp_port = 0;

  TlsFiles tls;
  // Plain connections are refused.
  bool tls_required = false;

  // Pages that may open a WebSocket. None: the server's own and, if `addresses` are all of the loopback, those of
  // localhost, 127.0.0.1 and [::1] with any port.
  std::vector<std::string> origins;
  // Names that the Host of a request may have; none: any. A page of the server's own may then open a WebSocket only as
  // localhost if `addresses` are all of the loopback. Numeric hosts always pass.
  std::vector<std::string> hosts;
  // The pages are in this folder; empty: there are none.
  std::string web_root;

  AdmissionLimits admission;
  // Numeric addresses to which the limits of one address do not apply, such as those of load tools and proxies.
  std::vector<std::string> exempt_addresses = {"127.0.0.1", "::1"};
  // The numeric addresses of proxies. Their connections must begin with a header of the PROXY protocol, which names the
  // client's address.
  std::vector<std::string> proxy_protocol;
  // Bounds the wait for the first bytes, and again the TLS handshake.
  std::chrono::milliseconds opening_timeout{5000};
  // Bounds a whole HTTP request, including the wait for it.
  std::chrono::milliseconds request_timeout{10000};
  // Bounds each 64 KiB of a response.
  std::chrono::milliseconds response_timeout{10000};
  // A silent WebSocket gets a ping after this time, and is closed after twice this time.
  std::chrono::milliseconds ping_after{15000};
  std::size_t requests_per_connection_max = 100;
  // Bounds the pages of a connection in a second, and at once.
  double page_bytes_per_s = 32 << 20;
};

// Returns an empty string when the options agree with each other; else one line.
std::string validate(const TransportOptions& options);

}  // namespace hairnet::server
