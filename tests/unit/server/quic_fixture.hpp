#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/link/webtransport/session.hpp"
#include "server/quic/endpoint.hpp"
#include "tests/support/http3_client.hpp"
#include "tests/support/quic_client.hpp"

namespace hairnet::quic {

// A session that stores every call of its connection.
class RecordingSink final : public SessionSink {
 public:
  void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t) override {
    received.insert(received.end(), bytes.begin(), bytes.end());
    if (throws) throw std::bad_alloc();
    if (take) take();
  }
  void on_datagram(std::span<const std::uint8_t> bytes, std::int64_t) override {
    datagrams.emplace_back(bytes.begin(), bytes.end());
  }
  void on_writable(std::int64_t) override {
    ++writable;
    if (send_more) send_more();
  }
  void on_downloads_writable(std::int64_t) override {
    ++downloads_writable;
    if (send_more) send_more();
  }
  void on_download_stopped(std::int64_t download, std::int64_t) override { stopped.push_back(download); }
  void on_sent(std::size_t bytes) override { sent_bytes += bytes; }
  void on_closed(std::string_view error, std::int64_t) override { closed.emplace_back(error); }

  Bytes received;
  std::vector<Bytes> datagrams;
  std::vector<std::string> closed;
  // The test's code for on_writable() and on_downloads_writable(), and for on_bytes().
  std::function<void()> send_more, take;
  std::vector<std::int64_t> stopped;
  int writable = 0, downloads_writable = 0;
  std::size_t sent_bytes = 0;
  bool throws = false;
};

// An endpoint and clients on a network in memory, whose time the test moves.
class QuicNetwork : public Gate {
 public:
  static constexpr std::int64_t kStep_ns = 1'000'000;
  static constexpr std::uint16_t kPort = 7420;

  explicit QuicNetwork(const EndpointOptions& options = {})
      : endpoint(
            options, credentials, *this, counters, [this](std::span<const Burst> bursts) { take(bursts); }, now_ns) {}

  QuicClient& add_client(const QuicClient::Options& options = {}, std::uint8_t host = 1) {
    const Path path{loopback(static_cast<std::uint16_t>(10'000 + clients.size()), host), loopback(kPort)};
    return *clients.emplace_back(std::make_unique<QuicClient>(path, now_ns, options));
  }
  // Runs for this time, or until `done`. Packets to the server arrive at once, unless `loses` returns true for them.
  bool run(
      double seconds, const std::function<bool()>& done = [] { return false; }) {
    const std::int64_t end_ns = now_ns + static_cast<std::int64_t>(seconds * 1e9);
    while (true) {
      deliver();
      if (done()) return true;
      if (now_ns >= end_ns) return false;
      now_ns += kStep_ns;
    }
  }
  void deliver() {
    // The two ends answer each other until both are quiet. Fifty turns bound ends that never are.
    for (int turn = 0; turn < 50; ++turn) {
      bool is_quiet = true;
      for (const auto& [local, session] : sessions) {
        session->poll(now_ns);
        session->write(
            [&, from = local](std::span<const std::uint8_t> packet) {
              is_quiet = false;
              if (!loses || !loses()) endpoint.receive({loopback(kPort), from}, 0, packet, now_ns);
            },
            now_ns);
      }
      for (std::size_t i = 0; i < clients.size(); ++i) {
        clients[i]->poll(now_ns);
        for (const Bytes& packet : clients[i]->write(now_ns)) {
          is_quiet = false;
          client_bytes += packet.size();
          if (loses && loses()) continue;
          endpoint.receive({clients[i]->path().remote, clients[i]->path().local}, 0, packet, now_ns);
        }
      }
      endpoint.flush(now_ns);
      // All packets to clients of one turn arrive together, so the time moves once for them.
      if (!in_flight.empty()) now_ns += travel_ns;
      for (auto& [to, packet] : std::exchange(in_flight, {})) {
        is_quiet = false;
        if (loses && loses()) continue;
        for (const auto& client : clients)
          if (client->path().local == to) client->receive(packet, now_ns);
        for (const auto& [local, session] : sessions)
          if (local == to) session->receive(packet, now_ns);
      }
      if (is_quiet) return;
    }
  }
  // A client whose session is open, with its channel.
  std::pair<QuicClient&, std::int64_t> join() {
    QuicClient& client = add_client();
    EXPECT_TRUE(run(2, [&] { return client.is_ready(); }));
    const std::int64_t session = client.open_session();
    EXPECT_TRUE(run(2, [&] { return !client.received[session].empty(); }));
    const std::int64_t channel = client.open_channel(session);
    const std::size_t before = sinks.size();
    EXPECT_TRUE(run(2, [&] { return sinks.size() > before; }));
    return {client, channel};
  }

  bool may_begin(std::int64_t) override { return begins; }
  std::shared_ptr<void> admit(const Address& remote, std::int64_t) override {
    admitted.push_back(remote.text());
    return admits ? tickets.emplace_back(std::make_shared<int>(0)) : nullptr;
  }
  int on_request(const Address&, const http3::Request& asked) override {
    requests.push_back(asked);
    return status;
  }
  std::shared_ptr<SessionSink> on_session(Connection& connection, std::int64_t) override {
    connections.push_back(&connection);
    return sinks.emplace_back(std::make_shared<RecordingSink>());
  }

  const std::shared_ptr<const Credentials> credentials = Credentials::make(0, 2'000'000'000).value();
  std::int64_t now_ns = 1'000'000'000;
  // Packets to clients take so long.
  std::int64_t travel_ns = 0;
  QuicCounters counters;
  bool begins = true, admits = true;
  int status = 200;
  std::vector<std::string> admitted;
  std::vector<std::shared_ptr<void>> tickets;
  std::vector<http3::Request> requests;
  std::vector<Connection*> connections;
  std::vector<std::shared_ptr<RecordingSink>> sinks;
  std::vector<std::pair<Address, Bytes>> in_flight;
  std::vector<std::unique_ptr<QuicClient>> clients;
  // Sessions of the client library, each with its local address. The test that adds them owns them.
  std::vector<std::pair<Address, link::WebTransportSession*>> sessions;
  std::function<bool()> loses;
  std::size_t client_bytes = 0, server_bytes = 0, largest_burst_packets = 0;
  Endpoint endpoint;

 private:
  void take(std::span<const Burst> bursts) {
    for (const Burst& burst : bursts) {
      std::size_t packets = 0;
      for (std::size_t at = 0; at < burst.bytes.size(); at += burst.segment_bytes, ++packets) {
        const auto bytes = burst.bytes.subspan(at, std::min(burst.segment_bytes, burst.bytes.size() - at));
        in_flight.emplace_back(burst.path.remote, Bytes(bytes.begin(), bytes.end()));
        server_bytes += bytes.size();
      }
      largest_burst_packets = std::max(largest_burst_packets, packets);
    }
  }
};

}  // namespace hairnet::quic
