#pragma once

#include "server/telemetry/counter.hpp"

namespace hairnet::quic {

// All counters of QUIC's folder. Any thread may read them; the endpoint's thread adds.
struct QuicCounters : server::CounterSet {
  using Counter = server::Counter;

  Counter packets_received{*this, "quic_packets_received", "UDP datagrams received."};
  Counter packets_sent{*this, "quic_packets_sent", "UDP datagrams sent."};
  Counter bytes_received{*this, "quic_bytes_received", "Bytes of UDP datagrams received."};
  Counter bytes_sent{*this, "quic_bytes_sent", "Bytes of UDP datagrams sent."};
  Counter handshakes_done{*this, "quic_handshakes_done", "Handshakes of QUIC that succeeded."};
  Counter retries_sent{*this, "quic_retries_sent", "Retries sent: an unverified address has to come again."};
  Counter versions_negotiated{*this, "quic_versions_negotiated", "Answers to clients of another version of QUIC."};
  Counter resets_sent{*this, "quic_resets_sent", "Resets sent for connections that are not known."};

  Counter dropped_malformed{*this, "quic_packets_dropped", "reason", "malformed", "UDP datagrams dropped, by reason."};
  // The packets belong to no connection.
  Counter dropped_unknown{*this, "quic_packets_dropped", "reason", "unknown"};
  // Too many connections begin at this moment.
  Counter dropped_rate{*this, "quic_packets_dropped", "reason", "rate"};
  // The server stops, and takes no new connections.
  Counter dropped_closed{*this, "quic_packets_dropped", "reason", "closed"};
  // The system did not take the packets that the server wanted to send.
  Counter dropped_unsent{*this, "quic_packets_dropped", "reason", "unsent"};

  // The token is another address's, expired or used.
  Counter refused_token{*this, "quic_connections_refused", "reason", "token",
                        "Connections of QUIC refused, by reason."};
  Counter refused_admission{*this, "quic_connections_refused", "reason", "admission"};
  Counter refused_protocol{*this, "quic_connections_refused", "reason", "alpn"};

  Counter closed_by_peer{*this, "quic_connections_closed", "reason", "peer", "Connections of QUIC closed, by reason."};
  Counter closed_by_server{*this, "quic_connections_closed", "reason", "server"};
  Counter closed_idle{*this, "quic_connections_closed", "reason", "idle"};
  Counter closed_handshake_timeout{*this, "quic_connections_closed", "reason", "handshake_timeout"};
  // No session began in time.
  Counter closed_opening_timeout{*this, "quic_connections_closed", "reason", "opening_timeout"};
  Counter closed_tls{*this, "quic_connections_closed", "reason", "tls"};
  Counter closed_quic_error{*this, "quic_connections_closed", "reason", "quic"};
  Counter closed_http3_error{*this, "quic_connections_closed", "reason", "http3"};

  Counter downloads_opened{*this, "quic_downloads_opened", "Streams opened for one download each."};
  Counter downloads_reset{*this, "quic_downloads_reset",
                          "Streams of downloads that this server reset before their end."};

  Counter datagrams_received{*this, "quic_datagrams_received", "Datagrams of sessions received."};
  Counter datagrams_sent{*this, "quic_datagrams_sent", "Datagrams of sessions sent."};
  Counter datagrams_lost{*this, "quic_datagrams_lost", "Datagrams of sessions sent that probably did not arrive."};
  // The session had not begun, or had ended.
  Counter datagrams_dropped_early{*this, "quic_datagrams_dropped", "reason", "no_session",
                                  "Datagrams of sessions dropped, by reason."};
  // The datagram names another session than the connection's.
  Counter datagrams_dropped_other{*this, "quic_datagrams_dropped", "reason", "other_session"};
  // The path or the peer takes no datagram of this size.
  Counter datagrams_dropped_unsent{*this, "quic_datagrams_dropped", "reason", "too_large"};
};

}  // namespace hairnet::quic
