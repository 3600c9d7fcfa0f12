#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/link/webtransport/session.hpp"
#include "tests/unit/server/quic_fixture.hpp"

namespace hairnet::link {

using Bytes = std::vector<std::uint8_t>;

// A WebTransportSession of the client library in a simulated network (tests/unit/server/quic_fixture.hpp), which
// records everything that the session reports. Bytes of the channel stay untaken until the test calls
// WebTransportSession::take(), which opens the server's window again.
class ClientEnd final : public WebTransportEvents {
 public:
  ClientEnd(quic::QuicNetwork& network, CertificateCheck check, std::uint16_t port = 20'000,
            const QuicOptions& options = {}) {
    const quic::Path path{quic::loopback(port), quic::loopback(quic::QuicNetwork::kPort)};
    auto made =
        WebTransportSession::create({path, "localhost:7420", "/wt", std::move(check)}, *this, network.now_ns, options);
    if (!made) {
      refusal = made.error();
      return;
    }
    session = std::move(*made);
    network.sessions.emplace_back(path.local, session.get());
  }
  void on_channel_bytes(std::span<const std::uint8_t> bytes) override {
    received.insert(received.end(), bytes.begin(), bytes.end());
    untaken += bytes.size();
    if (on_received) on_received();
  }
  void on_datagram(std::span<const std::uint8_t> bytes) override { datagrams.emplace_back(bytes.begin(), bytes.end()); }
  void on_download_bytes(StreamId stream, std::span<const std::uint8_t> bytes, bool is_last) override {
    Download& download = downloads[stream];
    download.received.insert(download.received.end(), bytes.begin(), bytes.end());
    download.untaken += bytes.size();
    download.is_ended = is_last;
    if (takes_downloads) session->take_download(stream, std::exchange(download.untaken, 0));
  }
  void on_download_reset(StreamId stream) override {
    Download& download = downloads[stream];
    download.was_reset = true;
    session->take_download(stream, std::exchange(download.untaken, 0));
  }

  struct Download {
    Bytes received;
    std::size_t untaken = 0;
    bool is_ended = false, was_reset = false;
  };
  // The downloads by their stream. With takes_downloads the bytes are taken at once; without it, the windows of
  // downloads fill up.
  std::map<StreamId, Download> downloads;
  bool takes_downloads = true;
  // Runs after each piece of the channel.
  std::function<void()> on_received;

  std::unique_ptr<WebTransportSession> session;
  // Why there is no session; empty when create() has succeeded.
  std::string refusal;
  Bytes received;
  // The bytes of the channel that the test has not taken yet.
  std::size_t untaken = 0;
  std::vector<Bytes> datagrams;
};

// Returns a check that accepts the certificate of the network by its hash, the second of two.
inline CertificateCheck pinned(const quic::QuicNetwork& network) {
  CertificateCheck check;
  check.host = "localhost";
  check.hashes = {quic::CertificateHash{}, network.credentials->hash()};
  return check;
}

}  // namespace hairnet::link
