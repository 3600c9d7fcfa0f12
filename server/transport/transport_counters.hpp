#pragma once

#include "server/quic/quic_counters.hpp"
#include "server/telemetry/counter.hpp"

namespace hairnet::server {

// Bytes count messages and pages, without TLS and without WebSocket framing. Pages count with their headers; bytes of
// HTTP requests do not count.
struct TransportCounters : CounterSet {
  Counter connections_accepted{*this, "connections_accepted", "Connections accepted, of all transports."};
  Counter connections_closed{*this, "connections_closed", "Accepted connections that are closed."};
  Counter accepts_failed{*this, "accepts_failed",
                         "Connections that the system could not hand over, such as without free descriptors."};
  Counter connections_refused_full{*this, "connections_refused", "reason", "full",
                                   "Connections refused by limits, by reason."};
  Counter connections_refused_address{*this, "connections_refused", "reason", "address"};
  Counter connections_refused_arrivals{*this, "connections_refused", "reason", "arrivals"};
  Counter connections_refused_address_rate{*this, "connections_refused", "reason", "address_rate"};
  Counter accepts_paused{*this, "accepts_paused",
                         "Pauses of accepting, since new connections of all addresses exceeded their rate."};
  Counter connections_refused_http{*this, "connections_refused", "reason", "http"};

  Counter connections_opened_tcp{*this, "connections_opened", "transport", "tcp",
                                 "Connections whose protocol is known, by transport."};
  Counter connections_opened_websocket{*this, "connections_opened", "transport", "websocket"};
  Counter connections_opened_webtransport{*this, "connections_opened", "transport", "webtransport"};
  // A connection counts here when its first request was accepted.
  Counter connections_opened_http{*this, "connections_opened", "transport", "http"};
  Counter connections_tls{*this, "connections_tls",
                          "Connections inside TLS, which also count as one of their transport."};

  Counter bytes_read{*this, "bytes_read", "Bytes of packets read, of all transports."};
  Counter bytes_written{*this, "bytes_written", "Bytes of packets and pages written, of all transports."};
  Counter received_bytes_tcp{*this, "received_bytes", "transport", "tcp", "Bytes of packets received, by transport."};
  Counter sent_bytes_tcp{*this, "sent_bytes", "transport", "tcp", "Bytes of packets and pages sent, by transport."};
  Counter received_bytes_websocket{*this, "received_bytes", "transport", "websocket"};
  Counter sent_bytes_websocket{*this, "sent_bytes", "transport", "websocket"};
  Counter received_bytes_webtransport{*this, "received_bytes", "transport", "webtransport"};
  Counter sent_bytes_webtransport{*this, "sent_bytes", "transport", "webtransport"};
  Counter received_packets_webtransport{*this, "received_packets", "transport", "webtransport",
                                        "Packets received, by transport."};
  Counter sent_packets_webtransport{*this, "sent_packets", "transport", "webtransport", "Packets sent, by transport."};
  Counter sent_bytes_http{*this, "sent_bytes", "transport", "http"};
  Counter received_packets_tcp{*this, "received_packets", "transport", "tcp"};
  Counter sent_packets_tcp{*this, "sent_packets", "transport", "tcp"};
  Counter received_packets_websocket{*this, "received_packets", "transport", "websocket"};
  Counter sent_packets_websocket{*this, "sent_packets", "transport", "websocket"};

  Counter handshakes_failed_silent{*this, "handshakes_failed", "reason", "silent",
                                   "Connections closed before their protocol was known, by reason."};
  Counter handshakes_failed_timeout{*this, "handshakes_failed", "reason", "timeout"};
  Counter handshakes_failed_tls{*this, "handshakes_failed", "reason", "tls"};
  // The peer began with TLS, but the server has no certificate.
  Counter handshakes_failed_tls_absent{*this, "handshakes_failed", "reason", "tls_absent"};
  // The connection was plain, but the server requires TLS.
  Counter handshakes_failed_tls_required{*this, "handshakes_failed", "reason", "tls_required"};
  // The connection of a proxy did not begin with a header of the PROXY protocol.
  Counter handshakes_failed_proxy{*this, "handshakes_failed", "reason", "proxy"};
  Counter handshakes_failed_http{*this, "handshakes_failed", "reason", "http"};
  Counter handshakes_failed_websocket{*this, "handshakes_failed", "reason", "websocket"};
  Counter origins_refused{*this, "origins_refused", "WebSockets of pages whose origin is not allowed."};
  Counter hosts_refused{*this, "hosts_refused", "Requests whose Host is not allowed."};
  Counter pages_delayed{*this, "pages_delayed",
                        "Pieces of pages that waited, as their connection had its share of bytes."};
  Counter connections_cut_leaving{*this, "connections_cut", "reason", "leaving",
                                  "Connections closed before their last bytes were read, by reason."};

  Counter http_responses_2xx{*this, "http_responses", "code", "2xx",
                             "Responses of HTTP, by the class of their status code."};
  Counter http_responses_3xx{*this, "http_responses", "code", "3xx"};
  Counter http_responses_4xx{*this, "http_responses", "code", "4xx"};
  Counter http_responses_5xx{*this, "http_responses", "code", "5xx"};

  Counter websockets_closed_text{*this, "websockets_closed", "reason", "text",
                                 "WebSockets closed by the server, by reason."};
  Counter websockets_closed_oversize{*this, "websockets_closed", "reason", "oversize"};
  Counter websockets_closed_malformed{*this, "websockets_closed", "reason", "malformed"};
  Counter websockets_closed_timeout{*this, "websockets_closed", "reason", "timeout"};

  // The counters of QUIC are a set of their own, which app/metrics lists apart.
  quic::QuicCounters quic;
};

}  // namespace hairnet::server
