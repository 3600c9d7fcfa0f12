#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

#include "server/transport/tcp_listener.hpp"

namespace hairnet::server {
namespace {

constexpr std::size_t kPacketMax = 1u << 20;

// A blocking-free socket of the other end.
class Peer {
 public:
  explicit Peer(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  }
  ~Peer() { ::close(socket_); }
  // As much as the socket takes.
  std::size_t send(std::span<const std::uint8_t> bytes) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    return sent > 0 ? static_cast<std::size_t>(sent) : 0;
  }
  void receive() {
    std::uint8_t buffer[65536];
    ssize_t count = 0;
    while ((count = ::recv(socket_, buffer, sizeof(buffer), 0)) > 0)
      received.insert(received.end(), buffer, buffer + count);
    ended |= count == 0 || (count < 0 && errno == ECONNRESET);
  }
  std::vector<std::uint8_t> received;
  bool ended = false;

 private:
  int socket_;
};

// Sends every packet back.
class Echo final : public PacketSink {
 public:
  explicit Echo(std::shared_ptr<Connection> c) : connection(std::move(c)) {}
  void on_packet(std::span<const std::uint8_t> packet, std::int64_t) override {
    waiting.emplace_back(packet.begin(), packet.end());
    flush();
  }
  void on_broken_stream(std::int64_t) override { broken = true; }
  void on_writable(std::int64_t) override { flush(); }
  void on_closed(std::string_view, std::int64_t) override { closed = true; }
  void flush() {
    while (!waiting.empty() && connection->writable()) {
      connection->send(std::move(waiting.front()));
      waiting.erase(waiting.begin());
    }
  }
  std::shared_ptr<Connection> connection;
  std::vector<std::vector<std::uint8_t>> waiting;
  bool broken = false, closed = false;
};

std::vector<std::uint8_t> packet(std::size_t bytes, std::uint8_t fill) {
  std::vector<std::uint8_t> made(bytes, fill);
  const auto counted = static_cast<std::uint32_t>(bytes - 4);
  std::memcpy(made.data(), &counted, 4);
  return made;
}

class TransportTest : public testing::Test {
 protected:
  void SetUp() override {
    auto created = TcpListener::create(loop_, {"127.0.0.1", 0, kPacketMax}, counters_,
                                       [this](std::shared_ptr<Connection> connection, std::int64_t) -> PacketSink* {
                                         if (refuse_) {
                                           connection->send(packet(32, 9));
                                           connection->close("refused");
                                           return nullptr;
                                         }
                                         echoes_.push_back(std::make_unique<Echo>(std::move(connection)));
                                         return echoes_.back().get();
                                       });
    ASSERT_TRUE(created) << created.error();
    listener_ = std::move(*created);
  }
  // Runs the loop until `done`, or gives up: a bound on rounds and not on time.
  template <class Done>
  bool run_until(Done done) {
    for (int i = 0; i < 20'000; ++i) {
      loop_.poll();
      if (done()) return true;
      ::poll(nullptr, 0, i < 1000 ? 0 : 1);
    }
    return false;
  }

  TransportCounters counters_;
  IoLoop loop_;
  std::vector<std::unique_ptr<Echo>> echoes_;
  bool refuse_ = false;
  std::unique_ptr<TcpListener> listener_;
};

TEST_F(TransportTest, packets_come_back_whole_however_the_bytes_are_cut) {
  std::vector<std::uint8_t> sent;
  for (std::size_t i = 0; i < 60; ++i) {
    const auto one = packet(16 + i * 37, static_cast<std::uint8_t>(i));
    sent.insert(sent.end(), one.begin(), one.end());
  }
  Peer peer(listener_->port());
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
}

TEST_F(TransportTest, a_peer_that_does_not_read_makes_the_connection_unwritable_and_loses_nothing) {
  constexpr std::size_t kPackets = 64;
  Peer peer(listener_->port());
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1; }));
  Echo& echo = *echoes_[0];
  for (std::size_t i = 0; i < kPackets; ++i)
    echo.waiting.push_back(packet(kPacketMax / 2, static_cast<std::uint8_t>(i)));
  echo.flush();
  EXPECT_FALSE(echo.connection->writable());
  run_until([] { return false; });
  EXPECT_FALSE(echo.connection->writable());
  EXPECT_FALSE(echo.waiting.empty());
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return peer.received.size() == kPackets * kPacketMax / 2;
  }));
  EXPECT_TRUE(echo.connection->writable());
  for (std::size_t i = 0; i < kPackets; ++i) ASSERT_EQ(peer.received[i * kPacketMax / 2 + 100], i);
}

TEST_F(TransportTest, an_oversize_prefix_breaks_the_stream) {
  Peer peer(listener_->port());
  const std::vector<std::uint8_t> prefix{0xff, 0xff, 0xff, 0x7f, 0, 0, 0, 0};
  ASSERT_EQ(peer.send(prefix), prefix.size());
  ASSERT_TRUE(run_until([&] { return !echoes_.empty() && echoes_[0]->broken; }));
}

TEST_F(TransportTest, a_closing_connection_sends_what_waits_and_ends) {
  Peer peer(listener_->port());
  ASSERT_TRUE(run_until([&] { return echoes_.size() == 1; }));
  echoes_[0]->connection->send(packet(200'000, 5));
  echoes_[0]->connection->close("done");
  EXPECT_FALSE(echoes_[0]->connection->writable());
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return peer.ended;
  }));
  EXPECT_EQ(peer.received.size(), 200'000u);
  EXPECT_FALSE(echoes_[0]->closed) << "the one who closes is not told";
}

TEST_F(TransportTest, the_sink_is_told_once_when_the_peer_goes) {
  {
    Peer peer(listener_->port());
    ASSERT_TRUE(run_until([&] { return echoes_.size() == 1; }));
  }
  ASSERT_TRUE(run_until([&] { return echoes_[0]->closed; }));
  echoes_.clear();
  ASSERT_TRUE(run_until([&] { return counters_.connections_closed.value() == 1; }));
}

TEST_F(TransportTest, a_refused_connection_still_gets_the_last_word) {
  refuse_ = true;
  Peer peer(listener_->port());
  ASSERT_TRUE(run_until([&] {
    peer.receive();
    return peer.ended;
  }));
  EXPECT_EQ(peer.received, packet(32, 9));
}

TEST_F(TransportTest, a_port_in_use_is_one_clear_line) {
  const auto second = TcpListener::create(loop_, {"127.0.0.1", listener_->port(), kPacketMax}, counters_, {});
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error(), testing::StartsWith("cannot listen on 127.0.0.1:"));
  EXPECT_THAT(second.error(), testing::HasSubstr("in use"));
  EXPECT_FALSE(TcpListener::create(loop_, {"not-an-address", 0, kPacketMax}, counters_, {}));
}

}  // namespace
}  // namespace hairnet::server
