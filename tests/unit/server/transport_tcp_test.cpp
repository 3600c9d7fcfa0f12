#include "schema/limits.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace hairnet::server {
namespace {

TEST_F(TransportTest, packets_come_back_whole_however_the_bytes_are_cut) {
  std::vector<std::uint8_t> sent;
  for (std::size_t i = 0; i < 60; ++i) {
    const auto one = packet(16 + i * 37, static_cast<std::uint8_t>(i));
    sent.insert(sent.end(), one.begin(), one.end());
  }
  Peer peer(listener_->port());
  // Pieces of 1 to 101 bytes cut the packets anywhere, also within their prefixes.
  std::size_t at = 0, cut = 1;
  ASSERT_TRUE(run_until([&] {
    if (at < sent.size()) {
      at += peer.send({sent.data() + at, std::min(cut, sent.size() - at)});
      cut = cut * 7 % 101 + 1;
    }
    peer.receive();
    return peer.received.size() >= sent.size();
  }));
  EXPECT_EQ(peer.received, sent);
  EXPECT_EQ(counters_.received_packets_tcp.value(), 60u);
  EXPECT_TRUE(run_until([&] { return counters_.sent_packets_tcp.value() == 60; }));
  EXPECT_EQ(counters_.received_packets_websocket.value(), 0u);
}

TEST_F(TransportTest, a_peer_that_does_not_read_makes_the_connection_unwritable_and_loses_nothing) {
  // These 32 MiB are more than the sockets of both ends take.
  constexpr std::size_t kPackets = 64, kBytes = std::size_t{512} << 10;
  Peer peer(listener_->port());
  peer.send(packet(32, 1));
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return peer.received.size() == 32;
  }));
  peer.received.clear();
  Echo& echo = *echoes_[0];
  for (std::size_t i = 0; i < kPackets; ++i) echo.waiting.push_back(packet(kBytes, static_cast<std::uint8_t>(i)));
  echo.flush();
  EXPECT_FALSE(echo.connection->writable());
  run_rounds(1000);
  EXPECT_FALSE(echo.connection->writable());
  EXPECT_FALSE(echo.waiting.empty());
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return peer.received.size() == kPackets * kBytes;
  }));
  EXPECT_TRUE(echo.connection->writable());
  for (std::size_t i = 0; i < kPackets; ++i) ASSERT_EQ(peer.received[i * kBytes + 100], i);
}

TEST_F(TransportTest, a_packet_for_which_no_memory_was_left_ends_its_connection_only) {
  Peer unlucky(listener_->port()), other(listener_->port());
  unlucky.send(packet(32, 1));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1; }));
  echoes_[0]->finds_no_memory = true;
  unlucky.send(packet(32, 2));
  other.send(packet(32, 3));
  EXPECT_TRUE(run_until([&] {
    unlucky.receive();
    other.receive();
    return unlucky.ended && other.received.size() == 32;
  }));
  ASSERT_EQ(echoes_.size(), 2u);
  EXPECT_EQ(echoes_[0]->closed, 1);
  EXPECT_EQ(echoes_[0]->reason, "no memory was left");
  EXPECT_EQ(echoes_[1]->closed, 0);
}

TEST_F(TransportTest, an_oversize_prefix_breaks_the_stream) {
  Peer peer(listener_->port());
  // The prefix announces 2 GiB, and a packet has 4 MiB at most (kPacketBytesMax).
  const std::vector<std::uint8_t> prefix{0xff, 0xff, 0xff, 0x7f, 0, 0, 0, 0};
  ASSERT_EQ(peer.send(prefix), prefix.size());
  ASSERT_TRUE(run_until([&] { return !echoes_.empty() && echoes_[0]->broken; }));
}

TEST_F(TransportTest, the_largest_packet_is_allowed_once_the_session_has_joined) {
  joins_ = false;
  Peer peer(listener_->port());
  peer.send(packet(kHelloPacketBytesMax, 1));
  ASSERT_TRUE(run_until([&] { return !echoes_.empty() && echoes_[0]->packets == 1; }));
  echoes_[0]->connection->mark_joined();
  const auto large = packet(wire::kPacketBytesMax, 2);
  std::size_t at = 0;
  ASSERT_TRUE(run_until([&] {
    if (at < large.size()) at += peer.send(std::span(large).subspan(at));
    peer.receive();
    return echoes_[0]->packets == 2;
  }));
  EXPECT_FALSE(echoes_[0]->broken);
}

TEST_F(TransportTest, before_the_session_has_joined_a_larger_packet_breaks_the_stream_by_its_prefix) {
  joins_ = false;
  Peer peer(listener_->port());
  const auto large = packet(kHelloPacketBytesMax + 1, 1);
  peer.send(std::span(large).first(4));
  ASSERT_TRUE(run_until([&] { return !echoes_.empty() && echoes_[0]->broken; }));
}

TEST_F(TransportTest, connections_that_never_joined_do_not_pile_up_while_they_leave) {
  // The peers read nothing and do not end their connections. At most kLeavingMax refused connections may wait for this.
  refuse_ = true;
  constexpr std::size_t kPeers = Admission::kLeavingMax + 40;
  std::vector<std::unique_ptr<Peer>> peers;
  for (std::size_t i = 0; i < kPeers; ++i) {
    peers.push_back(std::make_unique<Peer>(listener_->port()));
    peers.back()->send(packet(32, 1));
  }
  ASSERT_TRUE(run_until([&] { return counters_.connections_opened_tcp.value() == kPeers; }));
  run_rounds(20);
  EXPECT_GT(counters_.connections_cut_leaving.value(), 0u);
  EXPECT_LE(counters_.connections_accepted.value() - counters_.connections_closed.value(), Admission::kLeavingMax);
}

TEST_F(TransportTest, a_closing_connection_sends_what_waits_and_ends) {
  Peer peer(listener_->port());
  // A size prefix is enough to begin a session.
  peer.send(std::string_view("\x20\0\0\0", 4));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1; }));
  echoes_[0]->connection->send(packet(200'000, 5));
  echoes_[0]->connection->close("done");
  EXPECT_FALSE(echoes_[0]->connection->writable());
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return peer.ended;
  }));
  EXPECT_EQ(peer.received.size(), 200'000u);
  EXPECT_EQ(echoes_[0]->closed, 0) << "the one who closes is not told";
}

TEST_F(TransportTest, the_sink_is_called_once_when_the_peer_leaves) {
  {
    Peer peer(listener_->port());
    peer.send(packet(32, 1));
    ASSERT_TRUE(run_until([&] { return echoes_.size() == 1; }));
  }
  ASSERT_TRUE(run_until([&] { return echoes_[0]->closed == 1; }));
  echoes_.clear();
  ASSERT_TRUE(run_until([&] { return counters_.connections_closed.value() == 1; }));
}

TEST_F(TransportTest, a_refused_connection_still_gets_the_last_word) {
  refuse_ = true;
  Peer peer(listener_->port());
  peer.send(packet(32, 1));
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return peer.ended;
  }));
  EXPECT_EQ(peer.received, packet(32, 9));
}

TEST_F(TransportTest, what_waits_leaves_in_the_order_it_was_sent_however_large_each_is) {
  Peer peer(listener_->port());
  peer.send(std::string_view("\x20\0\0\0", 4));
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1; }));
  std::vector<std::uint8_t> sent;
  for (std::size_t i = 0; i < 100; ++i) {
    // The sizes grow from 16 bytes to 77 KiB, so that small packets wait behind large ones.
    const auto one = packet(16 + i * i * 8, static_cast<std::uint8_t>(i));
    sent.insert(sent.end(), one.begin(), one.end());
    echoes_[0]->waiting.push_back(one);
  }
  echoes_[0]->flush();
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return peer.received.size() == sent.size();
  }));
  EXPECT_EQ(peer.received, sent);
  EXPECT_EQ(counters_.sent_bytes_tcp.value(), sent.size());
}

TEST_F(TransportTest, localhost_is_the_address_of_this_machine_alone) {
  TransportOptions named = options();
  named.addresses = {"localhost"};
  named.port = 0;
  const auto local = Listener::create(loop_, named, counters_, {});
  ASSERT_TRUE(local) << local.error();
  // A Peer connects to 127.0.0.1.
  const Peer peer((*local)->port());
}

TEST_F(TransportTest, a_port_in_use_is_one_clear_line) {
  TransportOptions taken = options();
  taken.port = listener_->port();
  const auto second = Listener::create(loop_, taken, counters_, {});
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error(), testing::StartsWith("cannot listen on 127.0.0.1:"));
  EXPECT_THAT(second.error(), testing::HasSubstr("in use"));
  TransportOptions nowhere = options();
  nowhere.addresses = {"not-an-address"};
  const auto refused = Listener::create(loop_, nowhere, counters_, {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error(), testing::HasSubstr("no numeric address; 127.0.0.1 or localhost is for this machine"));
}

}  // namespace
}  // namespace hairnet::server
