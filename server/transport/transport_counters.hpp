#pragma once

#include "server/telemetry/counter.hpp"

namespace hairnet::server {

// Bytes count messages and pages, without TLS and without WebSocket framing. Pages count with their headers; bytes of
// HTTP requests do not count.
struct TransportCounters : CounterSet {
  Counter connections_accepted{*this, "connections_accepted"};  // all, including those below, without the refused ones
  Counter connections_closed{*this, "connections_closed"};
  Counter accepts_failed{*this, "accepts_failed"};
  Counter connections_refused_full{*this, "connections_refused_full"};
  Counter connections_refused_address{*this, "connections_refused_address"};
  Counter connections_refused_arrivals{*this, "connections_refused_arrivals"};
  Counter connections_refused_http{*this, "connections_refused_http"};

  Counter connections_tcp{*this, "connections_tcp"};
  Counter connections_websocket{*this, "connections_websocket"};
  Counter connections_http{*this, "connections_http"};  // their first request was accepted
  Counter connections_tls{*this, "connections_tls"};    // also counted in one of the three above

  Counter bytes_read{*this, "bytes_read"};
  Counter bytes_written{*this, "bytes_written"};
  Counter bytes_read_tcp{*this, "bytes_read_tcp"};
  Counter bytes_written_tcp{*this, "bytes_written_tcp"};
  Counter bytes_read_websocket{*this, "bytes_read_websocket"};
  Counter bytes_written_websocket{*this, "bytes_written_websocket"};
  Counter bytes_written_http{*this, "bytes_written_http"};
  Counter packets_read_tcp{*this, "packets_read_tcp"};
  Counter packets_written_tcp{*this, "packets_written_tcp"};
  Counter packets_read_websocket{*this, "packets_read_websocket"};
  Counter packets_written_websocket{*this, "packets_written_websocket"};

  Counter handshakes_failed_silent{*this, "handshakes_failed_silent"};  // closed before its protocol was detected
  Counter handshakes_failed_timeout{*this, "handshakes_failed_timeout"};
  Counter handshakes_failed_tls{*this, "handshakes_failed_tls"};
  // TLS, but the server has no certificate
  Counter handshakes_failed_tls_absent{*this, "handshakes_failed_tls_absent"};
  // plain, but the server requires TLS
  Counter handshakes_failed_tls_required{*this, "handshakes_failed_tls_required"};
  Counter handshakes_failed_http{*this, "handshakes_failed_http"};
  Counter handshakes_failed_websocket{*this, "handshakes_failed_websocket"};
  Counter origins_refused{*this, "origins_refused"};

  Counter http_responses_2xx{*this, "http_responses_2xx"};
  Counter http_responses_3xx{*this, "http_responses_3xx"};
  Counter http_responses_4xx{*this, "http_responses_4xx"};
  Counter http_responses_5xx{*this, "http_responses_5xx"};

  Counter websockets_closed_text{*this, "websockets_closed_text"};
  Counter websockets_closed_oversize{*this, "websockets_closed_oversize"};
  Counter websockets_closed_malformed{*this, "websockets_closed_malformed"};
  Counter websockets_closed_timeout{*this, "websockets_closed_timeout"};
};

}  // namespace hairnet::server
