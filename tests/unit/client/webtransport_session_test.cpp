#include <random>

#include "client/link/webtransport/page.hpp"
#include "tests/unit/client/webtransport_client_end.hpp"

namespace hairnet::link {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(WebTransportSession, opens_with_a_pinned_certificate_and_carries_bytes_and_datagrams_both_ways) {
  quic::QuicNetwork network;
  ClientEnd client(network, pinned(network));
  ASSERT_TRUE(network.run(1, [&] { return client.session->is_open(); })) << client.session->reason();
  client.session->send({1, 2, 3});
  EXPECT_TRUE(client.session->send_datagram({7, 8}, network.now_ns));
  network.run(0.01);
  ASSERT_EQ(network.requests.size(), 1u);
  EXPECT_EQ(network.requests[0].authority, "localhost:7420");
  EXPECT_EQ(network.requests[0].path, "/wt");
  EXPECT_TRUE(network.requests[0].origin.empty());
  EXPECT_EQ(network.sinks[0]->received, (Bytes{1, 2, 3}));
  EXPECT_THAT(network.sinks[0]->datagrams, ElementsAre(Bytes{7, 8}));
  network.connections[0]->send({4, 5});
  network.connections[0]->send_datagram(Bytes(quic::kDatagramBytesMax, 9));
  network.run(0.01);
  EXPECT_EQ(client.received, (Bytes{4, 5}));
  EXPECT_THAT(client.datagrams, ElementsAre(Bytes(quic::kDatagramBytesMax, 9)));
  EXPECT_FALSE(client.session->send_datagram(Bytes(quic::kDatagramBytesMax + 1), network.now_ns));
}

TEST(WebTransportSession, carries_a_megabyte_each_way_over_a_lossy_line_in_order) {
  quic::QuicNetwork network;
  std::mt19937 random(3);
  // One packet of twenty is lost. The seed is fixed, so each run loses the same ones.
  network.loses = [&] { return random() % 20 == 0; };
  ClientEnd client(network, pinned(network));
  ASSERT_TRUE(network.run(5, [&] { return client.session->is_open(); })) << client.session->reason();
  Bytes bytes(1 << 20);
  // Bytes without a short period, so that a piece at a wrong place shows.
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * i >> 7);
  // The server learns of the channel by its first byte.
  client.session->send({0});
  ASSERT_TRUE(network.run(5, [&] { return !network.sinks.empty(); }));
  std::size_t up = 0, down = 0, waiting_max = 0;
  const auto piece = [&](std::size_t& sent) {
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(sent);
    const std::size_t count = std::min<std::size_t>(10'000, bytes.size() - sent);
    sent += count;
    return Bytes(begin, begin + static_cast<std::ptrdiff_t>(count));
  };
  EXPECT_TRUE(network.run(60, [&] {
    while (up < bytes.size() && client.session->is_writable()) client.session->send(piece(up));
    while (down < bytes.size() && network.connections[0]->is_writable()) network.connections[0]->send(piece(down));
    waiting_max = std::max(waiting_max, client.session->unsent_bytes());
    client.session->take(std::exchange(client.untaken, 0));
    return network.sinks[0]->received.size() == bytes.size() + 1 && client.received.size() == bytes.size();
  }));
  EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), network.sinks[0]->received.begin() + 1));
  EXPECT_EQ(client.received, bytes);
  // is_writable() stops the test above the limit, after at most one more piece of 10 000 bytes.
  EXPECT_LE(waiting_max, WebTransportSession::kUnsentBytesMax + 10'000);
}

TEST(WebTransportSession, lets_the_server_send_no_more_than_its_window_until_bytes_are_taken) {
  quic::QuicNetwork network;
  ClientEnd client(network, pinned(network));
  ASSERT_TRUE(network.run(1, [&] { return client.session->is_open(); }));
  client.session->send({0});
  network.run(0.1);
  const auto send_all = [&] {
    while (network.connections[0]->is_writable()) network.connections[0]->send(Bytes(10'000));
    return false;
  };
  network.run(1, send_all);
  const std::size_t window = QuicOptions().window_bytes;
  EXPECT_LE(client.received.size(), window);
  // The window must also be used, or the server would send in small pieces.
  EXPECT_GT(client.received.size(), window / 2);
  client.session->take(std::exchange(client.untaken, 0));
  network.run(1, send_all);
  EXPECT_GT(client.received.size(), window);
}

TEST(WebTransportSession, drops_the_oldest_poses_where_too_many_wait) {
  quic::QuicNetwork network;
  ClientEnd client(network, pinned(network));
  ASSERT_TRUE(network.run(1, [&] { return client.session->is_open(); }));
  client.session->send({0});
  network.run(0.1);
  for (int n = 0; n < 1000; ++n)
    EXPECT_TRUE(client.session->send_datagram(Bytes(1000, static_cast<std::uint8_t>(n / 4)), network.now_ns));
  EXPECT_LE(client.session->unsent_bytes(), WebTransportSession::kDatagramsMax * 1000);
  network.run(0.1);
  ASSERT_EQ(network.sinks[0]->datagrams.size(), WebTransportSession::kDatagramsMax);
  // Each datagram holds its number divided by four. The last kDatagramsMax, 16, of 1000 begin at 984, which is 246
  // times four.
  for (const Bytes& datagram : network.sinks[0]->datagrams) EXPECT_GE(datagram.back(), 246);
}

TEST(WebTransportSession, drops_poses_that_have_waited_for_long) {
  quic::QuicNetwork network;
  ClientEnd client(network, pinned(network));
  ASSERT_TRUE(network.run(1, [&] { return client.session->is_open(); }));
  client.session->send({0});
  network.run(0.1);
  for (std::uint8_t n = 1; n <= 3; ++n) {
    EXPECT_TRUE(client.session->send_datagram({n}, network.now_ns));
    // The next datagram drops those older than kDatagramAge_ns. Nothing is written meanwhile, so the first one is too
    // old for the third.
    network.now_ns += 2 * WebTransportSession::kDatagramAge_ns / 3;
  }
  network.run(0.1);
  EXPECT_THAT(network.sinks[0]->datagrams, ElementsAre(Bytes{2}, Bytes{3}));
}

// A man in the middle has another certificate. A check without hashes trusts the authorities of the system, which
// have not signed the test's certificate.
TEST(WebTransportSession, refuses_another_certificate_and_one_that_no_authority_has_signed) {
  quic::QuicNetwork network;
  CertificateCheck other, authorities;
  other.host = authorities.host = "localhost";
  other.hashes = {quic::CertificateHash{1}};
  ClientEnd wrong(network, other, 20'000), unsigned_one(network, authorities, 20'001);
  network.run(0.1);
  EXPECT_TRUE(wrong.session->is_over());
  EXPECT_THAT(wrong.session->reason(), HasSubstr("its certificate is refused (it is none of those"));
  EXPECT_TRUE(unsigned_one.session->is_over());
  EXPECT_THAT(unsigned_one.session->reason(), HasSubstr("its certificate is refused ("));
  EXPECT_TRUE(network.requests.empty());
  network.run(2);
  EXPECT_EQ(network.endpoint.connection_count(), 0u);
  CertificateCheck any;
  any.host = "localhost";
  any.insecure = true;
  ClientEnd trusting(network, any, 20'002);
  EXPECT_TRUE(network.run(1, [&] { return trusting.session->is_open(); }));
}

TEST(WebTransportSession, names_a_file_of_authorities_that_cannot_be_read) {
  quic::QuicNetwork network;
  CertificateCheck check;
  check.host = "localhost";
  check.ca_file = "/nowhere/ca.pem";
  ClientEnd client(network, check);
  EXPECT_FALSE(client.session);
  EXPECT_THAT(client.refusal, HasSubstr("/nowhere/ca.pem"));
}

TEST(WebTransportSession, says_what_the_server_answered_and_that_nothing_answers) {
  quic::QuicNetwork network;
  network.status = 404;
  ClientEnd refused(network, pinned(network), 20'000);
  network.run(1);
  EXPECT_TRUE(refused.session->is_over());
  EXPECT_EQ(refused.session->reason(), "it answers 404");
  network.loses = [] { return true; };
  ClientEnd alone(network, pinned(network), 20'001);
  // A handshake that gets no answer ends after QuicOptions::handshake_timeout_ns, 5 s.
  network.run(6);
  EXPECT_TRUE(alone.session->is_over());
  EXPECT_EQ(alone.session->reason(), "nothing answers on its UDP port");
}

TEST(WebTransportSession, ends_with_the_servers_reason_after_all_that_the_server_has_sent) {
  quic::QuicNetwork network;
  ClientEnd client(network, pinned(network));
  ASSERT_TRUE(network.run(1, [&] { return client.session->is_open(); }));
  client.session->send({0});
  network.run(0.1);
  std::mt19937 random(4);
  // One packet of five is lost, so the end of the session may overtake its last bytes.
  network.loses = [&] { return random() % 5 == 0; };
  network.connections[0]->send(Bytes(50'000, 3));
  network.connections[0]->close("the room is full", network.now_ns);
  EXPECT_TRUE(network.run(3, [&] { return client.session->is_over(); }));
  EXPECT_EQ(client.received, Bytes(50'000, 3));
  EXPECT_EQ(client.session->reason(), "the room is full");
}

// A server that did not hear of it would keep the person in the room until its idle time-out.
TEST(WebTransportSession, tells_the_server_its_own_end) {
  quic::QuicNetwork network;
  ClientEnd closing(network, pinned(network), 20'000), finished(network, pinned(network), 20'001);
  ASSERT_TRUE(network.run(1, [&] { return closing.session->is_open() && finished.session->is_open(); }));
  closing.session->send({0});
  finished.session->send({1, 2});
  finished.session->end_channel();
  network.run(0.1);
  closing.session->close("enough", network.now_ns);
  network.run(1);
  ASSERT_EQ(network.sinks.size(), 2u);
  for (const auto& sink : network.sinks) EXPECT_EQ(sink->closed.size(), 1u);
  EXPECT_TRUE(finished.session->is_over());
  EXPECT_EQ(network.endpoint.connection_count(), 0u);
}

TEST(WebTransportSession, stays_through_silence_and_ends_when_the_server_has_gone) {
  quic::QuicNetwork network;
  ClientEnd client(network, pinned(network));
  ASSERT_TRUE(network.run(1, [&] { return client.session->is_open(); }));
  client.session->send({0});
  network.run(60);
  EXPECT_TRUE(client.session->is_open());
  network.loses = [] { return true; };
  // QuicOptions::idle_timeout_ns is 15 s. Before, in 60 s without messages, keep-alive packets have held the session.
  EXPECT_TRUE(network.run(21, [&] { return client.session->is_over(); }));
  EXPECT_EQ(client.session->reason(), "nothing came for too long");
}

TEST(WebTransportSession, ignores_empty_packets) {
  quic::QuicNetwork network;
  ClientEnd client(network, pinned(network));
  client.session->receive({}, network.now_ns);
  ASSERT_TRUE(network.run(1, [&] { return client.session->is_open(); })) << client.session->reason();
  client.session->receive({}, network.now_ns);
  EXPECT_TRUE(client.session->is_open());
}

TEST(WebTransportSession, survives_damaged_packets) {
  std::mt19937 random(6);
  // Thirty handshakes, in which half of the server's packets have a wrong byte and a quarter are cut off. Nothing is
  // expected but that no sanitizer complains.
  for (int n = 0; n < 30; ++n) {
    quic::QuicNetwork network;
    ClientEnd client(network, pinned(network));
    for (int turn = 0; turn < 20; ++turn) {
      client.session->write(
          [&](std::span<const std::uint8_t> packet) {
            network.endpoint.receive({quic::loopback(quic::QuicNetwork::kPort), quic::loopback(20'000)}, 0, packet,
                                     network.now_ns);
          },
          network.now_ns);
      network.endpoint.flush(network.now_ns);
      for (auto& [to, packet] : std::exchange(network.in_flight, {})) {
        if (random() % 2 == 0) packet[random() % packet.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
        if (random() % 4 == 0) packet.resize(random() % packet.size());
        client.session->receive(packet, network.now_ns);
      }
      network.now_ns += 100'000'000;
      client.session->poll(network.now_ns);
    }
  }
}

TEST(WebTransportPage, says_port_path_and_hashes) {
  const std::string hash(43, 'A');
  const auto page = read_web_transport_page(R"({"port":7421,"path":"/wt","hashes":[")" + hash + R"(="]})");
  ASSERT_TRUE(page) << page.error();
  EXPECT_EQ(page->port, 7421);
  EXPECT_EQ(page->path, "/wt");
  EXPECT_THAT(page->hashes, ElementsAre(quic::CertificateHash{}));
  const auto none = read_web_transport_page(R"({"port":0,"path":"/wt","hashes":[]})");
  ASSERT_TRUE(none) << none.error();
  EXPECT_EQ(none->port, 0);
}

TEST(WebTransportPage, that_is_damaged_is_refused) {
  for (const char* text :
       {"", "{", "[]", "null", "7", R"({"path":"/wt","hashes":[]})", R"({"port":-1,"path":"/wt","hashes":[]})",
        R"({"port":65536,"path":"/wt","hashes":[]})", R"({"port":1.5,"path":"/wt","hashes":[]})",
        R"({"port":1,"path":"wt","hashes":[]})", R"({"port":1,"path":"/w t","hashes":[]})", R"({"port":1,"hashes":[]})",
        R"({"port":1,"path":"/wt"})", R"({"port":1,"path":"/wt","hashes":["AA=="]})",
        R"({"port":1,"path":"/wt","hashes":["no base64"]})", R"({"port":1,"path":"/wt","hashes":[1]})"}) {
    const auto page = read_web_transport_page(text);
    ASSERT_FALSE(page) << text;
    EXPECT_THAT(page.error(), HasSubstr("damaged"));
  }
}

}  // namespace
}  // namespace hairnet::link
