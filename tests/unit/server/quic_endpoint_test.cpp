#include <random>

#include "tests/unit/server/quic_fixture.hpp"

namespace hairnet::quic {
namespace {

TEST(QuicEndpoint, opens_a_session_and_carries_bytes_and_datagrams_both_ways) {
  QuicNetwork network;
  auto [client, channel] = network.join();
  ASSERT_EQ(network.requests.size(), 1u);
  EXPECT_EQ(network.requests[0].path, "/ws");
  client.send(channel, Bytes{1, 2, 3});
  client.send_datagram(Bytes{0, 7, 8});
  network.run(0.01);
  RecordingSink& sink = *network.sinks[0];
  EXPECT_EQ(sink.received, (Bytes{1, 2, 3}));
  EXPECT_THAT(sink.datagrams, testing::ElementsAre(Bytes{7, 8}));
  Connection& connection = *network.connections[0];
  EXPECT_EQ(connection.datagram_bytes_max(), kDatagramBytesMax);
  connection.send({4, 5});
  connection.send_datagram(Bytes(kDatagramBytesMax, 9));
  network.run(0.01);
  EXPECT_EQ(client.received[channel], (Bytes{4, 5}));
  ASSERT_EQ(client.datagrams.size(), 1u);
  EXPECT_EQ(client.datagrams[0].size(), 1 + kDatagramBytesMax);
  EXPECT_EQ(client.error(), 0);
  EXPECT_EQ(network.admitted.size(), 1u);
  EXPECT_EQ(network.counters.handshakes_done.value(), 1u);
}

TEST(QuicEndpoint, carries_a_megabyte_each_way_over_a_lossy_line_in_order) {
  QuicNetwork network;
  auto [client, channel] = network.join();
  std::mt19937 random(3);
  // One packet in twenty is lost, in both directions.
  network.loses = [&] { return random() % 20 == 0; };
  Bytes bytes(1 << 20);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * i >> 7);
  client.send(channel, bytes);
  Connection& connection = *network.connections[0];
  RecordingSink& sink = *network.sinks[0];
  std::size_t sent = 0, waiting_max = 0;
  const auto send_more = [&] {
    while (sent < bytes.size() && connection.is_writable()) {
      const std::size_t count = std::min<std::size_t>(10'000, bytes.size() - sent);
      const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(sent);
      connection.send({begin, begin + static_cast<std::ptrdiff_t>(count)});
      sent += count;
      waiting_max = std::max(waiting_max, connection.unsent_bytes());
    }
  };
  sink.send_more = send_more;
  send_more();
  EXPECT_TRUE(network.run(
      60, [&] { return sink.received.size() == bytes.size() && client.received[channel].size() == bytes.size(); }));
  EXPECT_EQ(sink.received, bytes);
  EXPECT_EQ(client.received[channel], bytes);
  // The connection is asked before each piece, so one piece of 10 000 bytes may exceed the bound.
  EXPECT_LE(waiting_max, Connection::kUnsentBytesMax + 10'000);
  EXPECT_GT(network.largest_burst_packets, 1u);
}

TEST(QuicEndpoint, does_not_resend_a_lost_datagram_and_counts_it) {
  QuicNetwork network;
  auto [client, channel] = network.join();
  network.run(0.2);
  network.loses = [] { return true; };
  network.connections[0]->send_datagram(Bytes(500, 1));
  network.deliver();
  network.loses = nullptr;
  network.connections[0]->send_datagram(Bytes(400, 2));
  network.run(3);
  ASSERT_EQ(client.datagrams.size(), 1u);
  // The first byte names the session; the 400 of the second datagram follow.
  EXPECT_EQ(client.datagrams[0].size(), 401u);
  EXPECT_EQ(network.counters.datagrams_lost.value(), 1u);
}

TEST(QuicEndpoint, and_client_acknowledge_datagrams_in_packets_that_go_anyway) {
  QuicNetwork network;
  QuicClient& client = network.join().first;
  network.run(1);
  const std::uint64_t received = network.counters.packets_received.value();
  const std::uint64_t sent = network.counters.packets_sent.value();
  // Acknowledgements in packets of their own would double the packets of a session in which poses and frames go all the
  // time.
  constexpr int kTicks = 100;
  // A tick lasts 33 ms: there are 90 poses and 30 frames in a second.
  for (int tick = 0; tick < kTicks; ++tick) {
    network.connections[0]->send_datagram(Bytes(700));
    for (int pose = 0; pose < 3; ++pose) {
      client.send_datagram({0, 1, 2});
      network.run(0.011);
    }
  }
  EXPECT_EQ(client.datagrams.size(), kTicks);
  // Each pose is a packet of the client and each frame one of the server. Three packets more may acknowledge what is
  // left at the beginning and the end.
  EXPECT_LE(network.counters.packets_received.value() - received, 3 * kTicks + 3);
  EXPECT_LE(network.counters.packets_sent.value() - sent, kTicks + 3);
  EXPECT_EQ(network.counters.datagrams_lost.value(), 0u);
}

TEST(QuicEndpoint, acknowledges_poses_in_time_when_it_has_nothing_to_send) {
  QuicNetwork network;
  QuicClient& client = network.join().first;
  network.run(1);
  const std::uint64_t sent = network.counters.packets_sent.value();
  client.send_datagram({0, 1, 2});
  // The acknowledgement waits for a frame for AnswerDelay::kDelay_ns, which is 37 ms: after 30 ms nothing is sent, and
  // after 40 ms one packet.
  network.run(0.03);
  EXPECT_EQ(network.counters.packets_sent.value(), sent);
  network.run(0.01);
  EXPECT_EQ(network.counters.packets_sent.value(), sent + 1);
  for (int pose = 0; pose < AnswerDelay::kDatagramsMax; ++pose) {
    client.send_datagram({0, 1, 2});
    network.deliver();
  }
  EXPECT_EQ(network.counters.packets_sent.value(), sent + 2) << "so many are acknowledged at once";
}

TEST(QuicEndpoint, knows_what_the_network_carries_once_it_holds_datagrams_back) {
  QuicNetwork network;
  network.travel_ns = 20'000'000;
  QuicClient& client = network.join().first;
  network.run(0.2);
  Connection& connection = *network.connections[0];
  EXPECT_EQ(connection.bytes_per_s(), 0);
  std::mt19937 random(3);
  // A third of all packets is lost, so congestion control must make datagrams wait.
  network.loses = [&] { return random() % 3 == 0; };
  for (int n = 0; n < 200; ++n) {
    if (connection.is_writable()) connection.send_datagram(Bytes(1000));
    // Acknowledgements go along with this datagram, as with a pose.
    client.send_datagram({0});
    network.run(0.01);
  }
  EXPECT_GT(connection.bytes_per_s(), 0);
  EXPECT_LT(connection.bytes_per_s(), 10'000 / 0.05) << "less than the first window";
}

TEST(QuicEndpoint, takes_no_more_when_a_few_datagrams_wait) {
  QuicNetwork network;
  auto [client, channel] = network.join();
  // A silent client acknowledges nothing, so what the congestion window does not take must wait. Datagrams that wait
  // long are old frames, so few may.
  client.go_silent();
  Connection& connection = *network.connections[0];
  std::size_t accepted = 0;
  for (; accepted < 1000 && connection.is_writable(); ++accepted) {
    connection.send_datagram(Bytes(1000));
    network.run(0.001);
  }
  EXPECT_LT(accepted, 100u);
  // The connection is asked before each datagram, so one of 1000 bytes may exceed the bound of 8 KiB.
  EXPECT_LT(connection.unsent_bytes(), DatagramQueue::kBytesMax + 1000);
}

TEST(QuicEndpoint, is_full_while_the_peer_takes_nothing_and_keeps_what_waits_bounded) {
  QuicNetwork network;
  auto [client, channel] = network.join();
  client.go_silent();
  Connection& connection = *network.connections[0];
  std::size_t accepted = 0;
  for (int n = 0; n < 10'000; ++n) {
    if (connection.is_writable()) {
      connection.send(Bytes(1000));
      if (connection.is_writable()) connection.send_datagram(Bytes(1000));
      ++accepted;
    }
    if (n % 100 == 0) network.run(0.001);
  }
  EXPECT_FALSE(connection.is_writable());
  // The connection is asked before each message and each datagram of 1000 bytes, so one of each may exceed the bound of
  // 64 KiB.
  EXPECT_LE(connection.unsent_bytes(), Connection::kUnsentBytesMax + 2000);
  EXPECT_LT(accepted, 1000u);
}

TEST(QuicEndpoint, drops_garbage_of_every_kind) {
  QuicNetwork network;
  std::mt19937 random(5);
  const Path path{loopback(QuicNetwork::kPort), loopback(9)};
  for (int n = 0; n < 20'000; ++n) {
    Bytes packet(random() % 1500);
    for (std::uint8_t& byte : packet) byte = static_cast<std::uint8_t>(random());
    // Every third packet has a long header of version 1, so the endpoint reads on behind the first byte.
    if (n % 3 == 0 && packet.size() > 4) {
      packet[0] = static_cast<std::uint8_t>(0xc0 | (random() & 0x3f));
      packet[1] = packet[2] = packet[3] = 0;
      packet[4] = 1;
    }
    network.endpoint.receive(path, 0, packet, network.now_ns);
  }
  network.endpoint.flush(network.now_ns);
  EXPECT_LE(network.endpoint.connection_count(), EndpointOptions().unverified_max);
  // A packet has 750 bytes on average, and a stranger may get three times what it sends (RFC 9000, section 8.1).
  EXPECT_LT(network.server_bytes, 3 * 20'000u * 750);
  EXPECT_TRUE(network.sinks.empty());
  auto [client, channel] = network.join();
  EXPECT_EQ(client.error(), 0);
}

TEST(QuicEndpoint, survives_damaged_packets_of_a_connection) {
  // Each of 30 handshakes has half of its packets damaged and a quarter cut short. The endpoint must neither crash nor
  // stop; whether the handshake succeeds does not matter.
  std::mt19937 random(6);
  for (int n = 0; n < 30; ++n) {
    QuicNetwork network;
    QuicClient& client = network.add_client();
    for (int turn = 0; turn < 20; ++turn) {
      for (Bytes& packet : client.write(network.now_ns)) {
        if (random() % 2 == 0) packet[random() % packet.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
        if (random() % 4 == 0) packet.resize(1 + random() % packet.size());
        network.endpoint.receive({client.path().remote, client.path().local}, 0, packet, network.now_ns);
      }
      network.endpoint.flush(network.now_ns);
      for (auto& [to, packet] : std::exchange(network.in_flight, {})) client.receive(packet, network.now_ns);
      network.now_ns += 100'000'000;
      client.poll(network.now_ns);
    }
  }
}

TEST(QuicEndpoint, sends_a_stranger_at_most_three_times_its_bytes) {
  QuicNetwork network;
  QuicClient& client = network.add_client();
  std::size_t sent = 0;
  for (const Bytes& packet : client.write(network.now_ns)) {
    sent += packet.size();
    network.endpoint.receive({client.path().remote, client.path().local}, 0, packet, network.now_ns);
  }
  // The server may repeat its packets until the handshake's time-out of 5 s (ConnectionOptions); 10 s pass.
  for (int n = 0; n < 100; ++n) {
    network.now_ns += 100'000'000;
    network.endpoint.flush(network.now_ns);
  }
  EXPECT_GT(network.server_bytes, 0u);
  EXPECT_LE(network.server_bytes, 3 * sent);
  EXPECT_EQ(network.endpoint.connection_count(), 0u);
  EXPECT_EQ(network.counters.closed_handshake_timeout.value(), 1u);
}

TEST(QuicEndpoint, bounds_half_open_handshakes_and_lets_verified_clients_in_by_retry) {
  EndpointOptions options;
  options.unverified_max = 8;
  QuicNetwork network(options);
  // A hundred clients send their first packet and nothing more: 8 take all places, and 92 get a Retry.
  for (int n = 0; n < 100; ++n) {
    QuicClient& client = network.add_client();
    for (const Bytes& packet : client.write(network.now_ns))
      network.endpoint.receive({client.path().remote, client.path().local}, 0, packet, network.now_ns);
    client.go_silent();
  }
  network.endpoint.flush(network.now_ns);
  network.in_flight.clear();
  EXPECT_EQ(network.endpoint.connection_count(), 8u);
  EXPECT_EQ(network.endpoint.unverified_count(), 8u);
  EXPECT_EQ(network.counters.retries_sent.value(), 92u);
  network.join();
  EXPECT_EQ(network.counters.retries_sent.value(), 93u);
  EXPECT_EQ(network.endpoint.unverified_count(), 8u);
  // The half-open handshakes end after 5 s (ConnectionOptions::handshake_timeout_ns).
  network.run(6);
  EXPECT_EQ(network.endpoint.connection_count(), 1u);
  EXPECT_EQ(network.endpoint.unverified_count(), 0u);
}

TEST(QuicEndpoint, refuses_a_retry_token_of_another_address) {
  EndpointOptions options;
  options.unverified_max = 0;
  QuicNetwork network(options);
  QuicClient& client = network.add_client();
  for (int turn = 0; turn < 4; ++turn) {
    // Each turn's packets come from another host than the last: the token of the Retry names the host before.
    for (const Bytes& packet : client.write(network.now_ns))
      network.endpoint.receive({client.path().remote, loopback(99, static_cast<std::uint8_t>(2 + turn))}, 0, packet,
                               network.now_ns);
    network.endpoint.flush(network.now_ns);
    for (auto& [to, packet] : std::exchange(network.in_flight, {})) client.receive(packet, network.now_ns);
  }
  EXPECT_EQ(network.counters.refused_token.value(), 1u);
  EXPECT_EQ(network.endpoint.connection_count(), 0u);
  EXPECT_TRUE(network.admitted.empty());
}

TEST(QuicEndpoint, refuses_who_is_not_admitted_and_drops_when_too_many_begin) {
  QuicNetwork network;
  network.admits = false;
  QuicClient& refused = network.add_client();
  network.run(1);
  EXPECT_NE(refused.error(), 0);
  EXPECT_EQ(network.counters.refused_admission.value(), 1u);
  network.begins = false;
  QuicClient& late = network.add_client();
  network.run(0.5);
  EXPECT_FALSE(late.is_ready());
  EXPECT_GT(network.counters.dropped_rate.value(), 0u);
  network.admits = network.begins = true;
  EXPECT_TRUE(network.run(5, [&] { return late.is_ready(); }));  // it has tried again
}

TEST(QuicEndpoint, holds_a_ticket_for_as_long_as_the_connection) {
  QuicNetwork network;
  auto [client, channel] = network.join();
  ASSERT_EQ(network.tickets.size(), 1u);
  // The test and the connection own the ticket.
  EXPECT_EQ(network.tickets[0].use_count(), 2);
  client.close(network.now_ns);
  network.run(2);
  EXPECT_EQ(network.tickets[0].use_count(), 1);
  EXPECT_THAT(network.sinks[0]->closed, testing::ElementsAre("the peer closed"));
  EXPECT_EQ(network.endpoint.connection_count(), 0u);
  EXPECT_EQ(network.counters.closed_by_peer.value(), 1u);
}

TEST(QuicEndpoint, negotiates_the_version) {
  QuicNetwork network;
  QuicClient::Options options;
  // This version is reserved for tests of version negotiation (RFC 9000, section 15).
  options.version = 0x1a2a3a4a;
  QuicClient& client = network.add_client(options);
  network.run(0.1);
  EXPECT_EQ(client.error(), NGTCP2_ERR_RECV_VERSION_NEGOTIATION);
  EXPECT_EQ(network.counters.versions_negotiated.value(), 1u);
  EXPECT_EQ(network.endpoint.connection_count(), 0u);
}

TEST(QuicEndpoint, takes_http3_alone) {
  for (const char* protocol : {"", "hq-interop"}) {
    QuicNetwork network;
    QuicClient::Options options;
    options.protocol = protocol;
    QuicClient& client = network.add_client(options);
    network.run(1);
    EXPECT_NE(client.error(), 0) << protocol;
    EXPECT_TRUE(network.admitted.empty()) << protocol;
    network.run(2);
    EXPECT_EQ(network.endpoint.connection_count(), 0u) << protocol;
  }
}

TEST(QuicEndpoint, resets_a_connection_that_it_does_not_know) {
  QuicNetwork network, restarted;
  auto [client, channel] = network.join();
  client.send(channel, Bytes(100, 1));
  for (const Bytes& packet : client.write(network.now_ns))
    restarted.endpoint.receive({client.path().remote, client.path().local}, 0, packet, network.now_ns);
  restarted.endpoint.flush(network.now_ns);
  ASSERT_EQ(restarted.in_flight.size(), 1u);
  // A reset must be smaller than the packet that caused it, so that two ends that do not know each other cannot answer
  // resets with resets for ever (RFC 9000, section 10.3.3).
  EXPECT_LT(restarted.in_flight[0].second.size(), 100u);
  EXPECT_EQ(restarted.counters.resets_sent.value(), 1u);
}

TEST(QuicEndpoint, of_the_same_identity_tells_the_clients_of_a_dead_one_at_once) {
  EndpointOptions options;
  // The identity gives the key of the tokens of resets. A server that starts again at the same place therefore makes
  // resets that the clients of its former life believe; those of any other server are ignored.
  options.identity = "machine:7420";
  QuicNetwork network(options), restarted(options), other;
  auto [client, channel] = network.join();
  for (QuicNetwork* next : {&other, &restarted}) {
    client.send(channel, Bytes(100, 1));
    for (const Bytes& packet : client.write(network.now_ns))
      next->endpoint.receive({client.path().remote, client.path().local}, 0, packet, network.now_ns);
    next->endpoint.flush(network.now_ns);
    for (auto& [to, packet] : std::exchange(next->in_flight, {})) client.receive(packet, network.now_ns);
    EXPECT_EQ(client.reason() == "the server does not know the connection any more", next == &restarted);
  }
}

TEST(QuicEndpoint, follows_a_client_to_another_address) {
  QuicNetwork network;
  auto [client, channel] = network.join();
  network.run(0.2);
  // A phone that leaves a wireless network has another address in the middle of its session.
  client.migrate(loopback(20'000, 3), network.now_ns);
  client.send(channel, Bytes{1});
  network.run(1);
  network.connections[0]->send({2});
  network.run(1);
  EXPECT_EQ(network.sinks[0]->received, Bytes{1});
  EXPECT_EQ(client.received[channel], Bytes{2});
  EXPECT_EQ(client.error(), 0);
  EXPECT_TRUE(network.sinks[0]->closed.empty());
}

TEST(QuicEndpoint, ends_a_silent_connection_and_one_without_a_session) {
  QuicNetwork network;
  auto [client, channel] = network.join();
  // A peer without a packet for 30 s is lost (ConnectionOptions::idle_timeout_ns), but after 15 s it is asked for a
  // sign of life. So a client that answers outlives 70 s without a message.
  network.run(70);
  EXPECT_TRUE(network.sinks[0]->closed.empty());
  client.go_silent();
  EXPECT_TRUE(network.run(60, [&] { return !network.sinks[0]->closed.empty(); }));
  EXPECT_EQ(network.counters.closed_idle.value(), 1u);
  QuicClient& idle = network.add_client();
  // A client without a session is closed after 5 s (ConnectionOptions::opening_timeout_ns).
  network.run(10);
  EXPECT_EQ(network.counters.closed_opening_timeout.value(), 1u);
  EXPECT_NE(idle.error(), 0);
  EXPECT_EQ(network.endpoint.connection_count(), 0u);
}

TEST(QuicEndpoint, closes_after_the_peer_has_all_that_was_sent) {
  QuicNetwork network;
  auto [client, channel] = network.join();
  std::mt19937 random(4);
  network.loses = [&] { return random() % 5 == 0; };
  Connection& connection = *network.connections[0];
  connection.send(Bytes(50'000, 3));
  connection.close("done", network.now_ns);
  EXPECT_TRUE(network.run(2, [&] { return client.error() != 0; }));
  EXPECT_EQ(client.received[channel], Bytes(50'000, 3));
  EXPECT_TRUE(client.ended[channel]);
  // The server's own side has closed the connection, so it gets no on_closed().
  EXPECT_TRUE(network.sinks[0]->closed.empty());
  network.loses = nullptr;
  network.run(2);
  EXPECT_EQ(network.endpoint.connection_count(), 0u);
}

TEST(QuicEndpoint, may_be_cut_from_within_the_packet_that_ends_the_session) {
  // The sink cuts the connection within its own call, while the rest of the same packet is still to be read. The
  // connection must not be destroyed, nor end twice, in the middle of the packet.
  QuicNetwork network;
  auto [client, channel] = network.join();
  network.sinks[0]->take = [&] { network.connections[0]->cut(network.now_ns); };
  client.send(channel, Bytes{1});
  client.send_datagram(Bytes{0xff});  // wrong HTTP/3, in the same packet
  network.run(2);
  EXPECT_EQ(network.sinks[0]->closed.size(), 1u);
  EXPECT_NE(client.error(), 0);
  EXPECT_EQ(network.endpoint.connection_count(), 0u);
}

TEST(QuicEndpoint, ends_a_session_whose_channel_the_peer_stops_reading_while_bytes_are_on_their_way) {
  for (const bool loses : {false, true}) {
    QuicNetwork network;
    auto [client, channel] = network.join();
    std::mt19937 random(5);
    if (loses) network.loses = [&] { return random() % 3 == 0; };
    network.connections[0]->send(Bytes(200'000, 3));
    network.run(0.01);
    client.stop(channel);
    network.run(0.002);
    network.connections[0]->send(Bytes(100, 4));
    network.run(5);
    EXPECT_EQ(network.sinks[0]->closed.size(), 1u) << loses;
    EXPECT_EQ(network.endpoint.connection_count(), 0u) << loses;
  }
}

TEST(QuicEndpoint, gives_up_closing_when_the_peer_reads_nothing) {
  QuicNetwork network;
  auto [client, channel] = network.join();
  client.go_silent();
  network.connections[0]->send(Bytes(50'000, 3));
  network.connections[0]->close("done", network.now_ns);
  // The peer has 2 s to acknowledge the last bytes (ConnectionOptions::linger_ns).
  network.run(4);
  EXPECT_EQ(network.endpoint.connection_count(), 0u);
}

TEST(QuicEndpoint, ends_the_connection_whose_http3_is_wrong_or_that_finds_no_memory) {
  QuicNetwork network;
  QuicClient& client = network.add_client();
  network.run(1);
  // The stream is a control stream (0), and begins with an empty DATA frame (0) in place of SETTINGS.
  client.send(client.open_stream(true), Bytes{0x00, 0x00, 0x00});
  network.run(2);
  EXPECT_EQ(network.counters.closed_http3_error.value(), 1u);
  EXPECT_EQ(client.error(), NGTCP2_ERR_DRAINING);
  // The code is H3_MISSING_SETTINGS (RFC 9114, section 8.1).
  EXPECT_EQ(client.close_error().error_code, 0x10au);
  auto [other, channel] = network.join();
  network.sinks.back()->throws = true;
  other.send(channel, Bytes{1});
  network.run(2);
  EXPECT_THAT(network.sinks.back()->closed, testing::ElementsAre("no memory was left"));
  EXPECT_EQ(network.endpoint.connection_count(), 0u);
}

TEST(QuicEndpoint, bounds_the_streams_and_unread_bytes_of_a_client) {
  QuicNetwork network;
  QuicClient& client = network.add_client();
  network.run(1);
  std::int64_t opened = 0;
  while (client.open_stream() >= 0) ++opened;
  // The bound is kStreamsMax of connection_callbacks.cpp.
  EXPECT_EQ(opened, 8);
}

TEST(QuicEndpoint, refuses_new_connections_when_it_is_closed_and_keeps_the_old) {
  QuicNetwork network;
  auto [client, channel] = network.join();
  // A server that drains takes no new clients, and those it has must still get their goodbye.
  network.endpoint.refuse_new();
  QuicClient& late = network.add_client();
  network.run(1);
  EXPECT_FALSE(late.is_ready());
  client.send(channel, Bytes{1});
  network.run(0.1);
  EXPECT_EQ(network.sinks[0]->received, Bytes{1});
}

TEST(QuicEndpoint, tells_its_sessions_when_it_is_destroyed) {
  auto network = std::make_unique<QuicNetwork>();
  network->join();
  const auto sink = network->sinks[0];
  network.reset();
  EXPECT_THAT(sink->closed, testing::ElementsAre("the server stops"));
}

}  // namespace
}  // namespace hairnet::quic
