#pragma once

#include <gnutls/gnutls.h>
#include <ngtcp2/ngtcp2.h>
#include <ngtcp2/ngtcp2_crypto.h>

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/quic/address.hpp"

namespace hairnet::quic {

using Bytes = std::vector<std::uint8_t>;

// 127.0.0.1, or another address of 127.0.0.0/8.
Address loopback(std::uint16_t port, std::uint8_t last = 1);

// The client's end of a QUIC connection, without I/O: for tests. It takes every certificate.
class QuicClient {
 public:
  struct Options {
    std::string protocol = "h3";
    std::uint32_t version = NGTCP2_PROTO_VER_V1;
    std::int64_t idle_timeout_ns = 60'000'000'000;
    std::uint64_t datagram_frame_bytes_max = 65'535;
    std::uint64_t window_bytes = 1 << 20;
  };

  QuicClient(const Path& path, std::int64_t now_ns) : QuicClient(path, now_ns, Options()) {}
  QuicClient(const Path& path, std::int64_t now_ns, const Options& options);
  QuicClient(const QuicClient&) = delete;
  QuicClient& operator=(const QuicClient&) = delete;
  ~QuicClient();

  // The packets that it wants to send, each once.
  std::vector<Bytes> write(std::int64_t now_ns);
  void receive(std::span<const std::uint8_t> packet, std::int64_t now_ns);
  void poll(std::int64_t now_ns);  // time-outs
  // Continues from another local address.
  void migrate(const Address& local, std::int64_t now_ns);

  std::int64_t open_stream(bool one_way = false);
  void send(std::int64_t stream, const Bytes& bytes, bool is_last = false);
  void stop(std::int64_t stream) { ngtcp2_conn_shutdown_stream_read(quic_, stream, 0); }  // its bytes are not wanted
  void send_datagram(Bytes bytes) { datagrams_.push_back(std::move(bytes)); }
  // Control stream, CONNECT, channel; what they are is in http3_client.hpp. The channel's number is returned.
  std::int64_t open_session(std::string_view authority = "localhost:7420", std::string_view path = "/ws",
                            std::string_view origin = "");
  std::int64_t open_channel(std::int64_t session);
  void close(std::int64_t now_ns);
  void go_silent() { is_silent_ = true; }  // sends nothing more

  [[nodiscard]] const Path& path() const { return path_; }
  [[nodiscard]] bool is_ready() const { return is_ready_; }
  // The code of a QUIC library that ended it; 0: none did.
  [[nodiscard]] int error() const { return error_; }
  [[nodiscard]] ngtcp2_connection_close_error close_error() const;
  [[nodiscard]] std::string leaf_certificate() const;  // in DER

  std::map<std::int64_t, Bytes> received;  // by stream
  std::map<std::int64_t, bool> ended;
  std::map<std::int64_t, std::uint64_t> resets;
  std::vector<Bytes> datagrams;
  Bytes token;  // for the next connection
  bool was_reset = false;

 private:
  friend struct QuicClientCallbacks;
  struct Stream {
    std::deque<Bytes> chunks;  // kept for the client's life
    std::size_t next = 0, offset = 0;
    bool is_ended = false, is_end_sent = false;
  };

  Path path_;
  ngtcp2_conn* quic_ = nullptr;
  gnutls_session_t tls_ = nullptr;
  gnutls_certificate_credentials_t credentials_ = nullptr;
  ngtcp2_crypto_conn_ref reference_{};
  std::map<std::int64_t, Stream> streams_;
  std::deque<Bytes> datagrams_, closing_;
  bool is_ready_ = false, is_silent_ = false;
  int error_ = 0;
  std::string protocol_;
};

}  // namespace hairnet::quic
