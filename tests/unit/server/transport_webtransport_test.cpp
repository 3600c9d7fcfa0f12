#include <array>
#include <cstring>

#include "server/quic/connection.hpp"
#include "tests/support/http3_client.hpp"
#include "tests/support/quic_client.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

// A QUIC client with a socket of its own.
class UdpPeer {
 public:
  explicit UdpPeer(std::uint16_t port, const char* from = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    inet_pton(AF_INET, from, &address.sin_addr);
    ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    socklen_t bytes = sizeof(address);
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &bytes);
    const auto local = quic::Address::of(reinterpret_cast<const sockaddr*>(&address), bytes);
    address.sin_port = htons(port);
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    client.emplace(quic::Path{local, quic::loopback(port)}, channel::monotonic_ns());
  }
  UdpPeer(const UdpPeer&) = delete;
  UdpPeer& operator=(const UdpPeer&) = delete;
  ~UdpPeer() { ::close(socket_); }
  void turn() {
    const std::int64_t now_ns = channel::monotonic_ns();
    std::array<std::uint8_t, 2048> buffer;
    for (ssize_t count = 0; (count = ::recv(socket_, buffer.data(), buffer.size(), 0)) > 0;)
      client->receive(std::span(buffer).first(static_cast<std::size_t>(count)), now_ns);
    client->poll(now_ns);
    for (const quic::Bytes& bytes : client->write(now_ns)) ::send(socket_, bytes.data(), bytes.size(), 0);
  }
  void send_raw(std::span<const std::uint8_t> bytes) { ::send(socket_, bytes.data(), bytes.size(), 0); }

  std::optional<quic::QuicClient> client;

 private:
  int socket_;
};

class WebTransportTest : public TransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = TransportTest::options();
    made.webtransport = true;
    return made;
  }
  template <class Done>
  bool run_peer(UdpPeer& peer, Done done) {
    return run_until([&] {
      peer.turn();
      return done();
    });
  }
  // Opens a session and its channel; -1 when the server refuses.
  std::int64_t join(UdpPeer& peer, const std::string& authority, std::string_view path = "/wt",
                    std::string_view origin = "") {
    quic::QuicClient& client = *peer.client;
    if (!run_peer(peer, [&] { return client.is_ready() || client.error() != 0; }) || client.error() != 0) return -1;
    const std::int64_t session = client.open_session(authority, path, origin);
    run_peer(peer, [&] { return client.received[session].size() >= 5 || client.error() != 0; });
    status_ = client.received[session];
    if (client.ended[session] || client.error() != 0) return -1;
    return client.open_channel(session);
  }
  std::string here() const { return "127.0.0.1:" + std::to_string(listener_->port()); }

  quic::Bytes status_;
};

TEST_F(WebTransportTest, echoes_packets_on_the_channel_and_takes_datagrams) {
  UdpPeer peer(listener_->port());
  const std::int64_t channel = join(peer, here());
  ASSERT_GE(channel, 0);
  quic::Bytes sent;
  for (const std::size_t bytes : {16, 5000, 300'000}) {
    const auto one = packet(bytes, static_cast<std::uint8_t>(bytes));
    peer.client->send(channel, one);
    sent.insert(sent.end(), one.begin(), one.end());
  }
  EXPECT_TRUE(run_peer(peer, [&] { return peer.client->received[channel].size() >= sent.size(); }));
  EXPECT_EQ(peer.client->received[channel], sent);
  ASSERT_EQ(echoes_.size(), 1u);
  EXPECT_EQ(echoes_[0]->connection->transport(), "wt");
  EXPECT_THAT(std::string(echoes_[0]->connection->peer()), StartsWith("127.0.0.1:"));
  EXPECT_EQ(echoes_[0]->connection->datagram_bytes_max(), quic::kDatagramBytesMax);
  EXPECT_TRUE(echoes_[0]->aligned);
  // A datagram of WebTransport begins with a quarter of its session's stream number, which is 0 here.
  quic::Bytes datagram{0};
  const auto small = packet(100, 4);
  datagram.insert(datagram.end(), small.begin(), small.end());
  peer.client->send_datagram(datagram);
  // Three packets came on the channel, and the datagram is the fourth.
  EXPECT_TRUE(run_peer(peer, [&] { return echoes_[0]->packets == 4; }));
  echoes_[0]->connection->send_datagram(packet(1024, 5));
  EXPECT_TRUE(run_peer(peer, [&] { return !peer.client->datagrams.empty(); }));
  EXPECT_EQ(counters_.connections_opened_webtransport.value(), 1u);
  EXPECT_EQ(counters_.received_packets_webtransport.value(), 4u);
  EXPECT_EQ(counters_.sent_packets_webtransport.value(), 5u);
  peer.client->close(channel::monotonic_ns());
  EXPECT_TRUE(run_peer(peer, [&] { return echoes_[0]->closed == 1; }));
  EXPECT_TRUE(all_closed());
}

TEST_F(WebTransportTest, the_page_of_the_tcp_port_says_how_to_connect) {
  Peer peer(listener_->port());
  const std::string page =
      answer_to(peer, "GET /wt.json HTTP/1.1\r\nHost: " + here() + "\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(page, HasSubstr("Access-Control-Allow-Origin: *"));
  EXPECT_THAT(page, HasSubstr("{\"port\":" + std::to_string(listener_->port()) + ",\"path\":\"/wt\",\"hashes\":[\""));
}

TEST_F(WebTransportTest, clients_that_come_by_the_public_port_are_told_its_number_and_others_its_own) {
  listener_->set_public_port(7431);
  for (const auto& [host, port] :
       std::vector<std::pair<std::string, std::uint16_t>>{{"hair.example:7431", 7431},
                                                          {"127.0.0.1:7431", 7431},
                                                          {"hair.example:17431", listener_->port()},
                                                          {"hair.example", listener_->port()}}) {
    Peer peer(listener_->port());
    EXPECT_THAT(answer_to(peer, "GET /wt.json HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n"),
                HasSubstr("{\"port\":" + std::to_string(port) + ","))
        << host;
  }
}

TEST_F(WebTransportTest, refuses_other_paths_and_pages_of_other_origins) {
  UdpPeer elsewhere(listener_->port()), stranger(listener_->port()), own(listener_->port());
  EXPECT_EQ(join(elsewhere, here(), "/ws"), -1);
  EXPECT_EQ(join(stranger, here(), "/wt", "https://evil.example"), -1);
  EXPECT_THAT(status_, testing::IsSupersetOf({'4', '0', '3'}));
  EXPECT_EQ(counters_.origins_refused.value(), 1u);
  EXPECT_GE(join(own, here(), "/wt", "http://" + here()), 0);
  // A site whose DNS answers with this machine's address has a page whose origin equals the host. The host refuses it:
  // on the loopback only localhost and numeric addresses may open a session.
  UdpPeer rebound(listener_->port());
  EXPECT_EQ(join(rebound, "evil.example:7420", "/wt", "https://evil.example:7420"), -1);
  EXPECT_EQ(counters_.hosts_refused.value(), 1u);
}

TEST_F(WebTransportTest, a_refused_session_gets_its_last_packet) {
  refuse_ = true;
  UdpPeer peer(listener_->port());
  const std::int64_t channel = join(peer, here());
  EXPECT_TRUE(run_peer(peer, [&] { return peer.client->error() != 0; }));
  EXPECT_EQ(peer.client->received[channel], packet(32, 9));
  EXPECT_TRUE(all_closed());
}

TEST_F(WebTransportTest, ends_a_session_whose_packets_are_too_large_before_it_has_joined) {
  joins_ = false;
  UdpPeer peer(listener_->port());
  const std::int64_t channel = join(peer, here());
  peer.client->send(channel, packet(kHelloPacketBytesMax + 1, 1));
  EXPECT_TRUE(run_peer(peer, [&] { return !echoes_.empty() && echoes_[0]->broken; }));
}

TEST_F(WebTransportTest, a_session_that_finds_no_memory_ends_alone) {
  UdpPeer first(listener_->port()), second(listener_->port());
  const std::int64_t one = join(first, here()), two = join(second, here());
  first.client->send(one, packet(16, 1));
  second.client->send(two, packet(16, 2));
  ASSERT_TRUE(run_until([&] {
    first.turn();
    second.turn();
    return echoes_.size() == 2 && echoes_[0]->packets + echoes_[1]->packets == 2;
  }));
  echoes_[0]->finds_no_memory = true;
  first.client->send(one, packet(16, 3));
  EXPECT_TRUE(run_peer(first, [&] { return echoes_[0]->closed == 1; }));
  second.client->send(two, packet(16, 4));
  EXPECT_TRUE(run_peer(second, [&] { return second.client->received[two].size() == 32; }));
}

TEST_F(WebTransportTest, takes_garbage_and_closes_while_a_session_is_open) {
  UdpPeer peer(listener_->port()), garbage(listener_->port());
  ASSERT_GE(join(peer, here()), 0);
  // The kernel may drop some of the 500 datagrams, so 400 are enough.
  for (int n = 0; n < 500; ++n)
    garbage.send_raw(quic::Bytes(static_cast<std::size_t>(n), static_cast<std::uint8_t>(n)));
  EXPECT_TRUE(run_peer(
      peer, [&] { return counters_.quic.dropped_malformed.value() + counters_.quic.dropped_unknown.value() > 400; }));
  listener_->close();
  listener_ = nullptr;
  EXPECT_TRUE(all_closed());
}

class CrowdedWebTransportTest : public WebTransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = WebTransportTest::options();
    made.exempt_addresses = {};
    made.admission.connections_per_address_max = 2;
    return made;
  }
};

TEST_F(CrowdedWebTransportTest, connections_of_one_address_count_together_with_its_tcp_ones) {
  // An address may have two connections: one of TCP and one of QUIC fill its share.
  Peer tcp(listener_->port());
  tcp.send(std::string_view("xxxx"));
  ASSERT_TRUE(run_until([&] { return counters_.connections_accepted.value() == 1; }));
  UdpPeer first(listener_->port()), second(listener_->port()), other(listener_->port(), "127.0.0.2");
  EXPECT_GE(join(first, here()), 0);
  EXPECT_EQ(join(second, here()), -1);
  EXPECT_EQ(counters_.connections_refused_address.value(), 1u);
  EXPECT_GE(join(other, here()), 0);
}

class EverywhereWebTransportTest : public WebTransportTest {
 protected:
  TransportOptions options() override {
    TransportOptions made = WebTransportTest::options();
    made.addresses = {"::"};
    return made;
  }
};

TEST_F(EverywhereWebTransportTest, one_socket_serves_ipv4_and_answers_from_the_address_that_was_asked) {
  for (const char* from : {"127.0.0.1", "127.0.0.3"}) {
    UdpPeer peer(listener_->port(), from);
    const std::int64_t channel = join(peer, here());
    ASSERT_GE(channel, 0) << from;
    const auto sent = packet(20'000, 7);
    peer.client->send(channel, sent);
    EXPECT_TRUE(run_peer(peer, [&] { return peer.client->received[channel].size() == sent.size(); }));
    EXPECT_THAT(std::string(echoes_.back()->connection->peer()), StartsWith(std::string(from) + ":"));
  }
}

class BusyUdpTest : public TransportTest {
 protected:
  // Another socket has the UDP port of the same number as the listener's TCP port.
  TransportOptions options() override {
    socket_ = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    socklen_t bytes = sizeof(address);
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &bytes);
    TransportOptions made;
    made.webtransport = true;
    made.port = ntohs(address.sin_port);
    return made;
  }
  ~BusyUdpTest() override { ::close(socket_); }
  int socket_ = -1;
};

TEST_F(BusyUdpTest, without_its_udp_port_the_server_tells_pages_port_0_and_goes_on) {
  Peer peer(listener_->port());
  EXPECT_THAT(answer_to(peer, "GET /wt.json HTTP/1.0\r\n\r\n"), HasSubstr("{\"port\":0,"));
  TransportOptions asked;
  asked.webtransport = true;
  asked.port = 0;
  asked.udp_port = listener_->port();
  TransportCounters counters;
  const auto refused = Listener::create(loop_, asked, counters, [](auto, auto) { return nullptr; });
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error(), HasSubstr("UDP port"));
}

}  // namespace
}  // namespace hairnet::server
