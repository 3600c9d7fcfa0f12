#pragma once

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/transport/listener.hpp"

namespace hairnet::server {

// The client's end of a TCP connection on the loopback. It never blocks, and sends any bytes, also wrong ones.
// `receive_bytes` makes its receive buffer small, so that the server's writes soon have to wait.
class Peer {
 public:
  explicit Peer(std::uint16_t port, int receive_bytes = 0, const char* from = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0)) {
    if (receive_bytes > 0) ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof(receive_bytes));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    inet_pton(AF_INET, from, &address.sin_addr);
    ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    address.sin_port = htons(port);
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  }
  // Connects over IPv6. Returns null on a machine without it.
  static std::unique_ptr<Peer> over_ipv6(std::uint16_t port) {
    const int socket = ::socket(AF_INET6, SOCK_STREAM | SOCK_NONBLOCK, 0);
    if (socket < 0) return nullptr;
    std::unique_ptr<Peer> peer(new Peer(OpenSocket{socket}));
    sockaddr_in6 address{};
    address.sin6_family = AF_INET6;
    address.sin6_addr = in6addr_loopback;
    // The system chooses a free port. It has none to give where ::1 is no address of the machine.
    if (::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) return nullptr;
    address.sin6_port = htons(port);
    ::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    return peer;
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  ~Peer() { leave(); }
  void leave() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }
  void end_writing() { ::shutdown(socket_, SHUT_WR); }
  // Sends as much as the socket takes.
  std::size_t send(std::span<const std::uint8_t> bytes) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    return sent > 0 ? static_cast<std::size_t>(sent) : 0;
  }
  std::size_t send(std::string_view text) {
    return send(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  }
  void receive() {
    std::uint8_t buffer[65536];
    ssize_t count = 0;
    while ((count = ::recv(socket_, buffer, sizeof(buffer), 0)) > 0)
      received.insert(received.end(), buffer, buffer + count);
    ended |= count == 0 || (count < 0 && (errno == ECONNRESET || errno == EPIPE));
  }
  [[nodiscard]] std::string text() const { return {received.begin(), received.end()}; }
  std::vector<std::uint8_t> received;
  bool ended = false;

 private:
  struct OpenSocket {
    int number;
  };
  explicit Peer(OpenSocket socket) : socket_(socket.number) {}

  int socket_;
};

// A session that sends every packet back. What its connection does not take yet waits.
class Echo final : public PacketSink {
 public:
  explicit Echo(std::shared_ptr<Connection> c, bool joins = true) : connection(std::move(c)) {
    if (joins) connection->mark_joined();
  }
  void on_packet(std::span<const std::uint8_t> packet, std::int64_t) override {
    aligned &= reinterpret_cast<std::uintptr_t>(packet.data()) % 8 == 0;
    ++packets;
    if (finds_no_memory) throw std::bad_alloc();
    waiting.emplace_back(packet.begin(), packet.end());
    flush();
  }
  void on_broken_stream(std::int64_t) override { broken = true; }
  void on_writable(std::int64_t) override { flush(); }
  void on_closed(std::string_view error, std::int64_t) override {
    ++closed;
    reason = error;
    connection->close("closed");
  }
  void flush() {
    std::size_t sent = 0;
    while (sent < waiting.size() && connection->writable()) connection->send(std::move(waiting[sent++]));
    waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(sent));
  }
  std::shared_ptr<Connection> connection;
  std::vector<std::vector<std::uint8_t>> waiting;
  std::size_t packets = 0;
  bool broken = false, aligned = true, finds_no_memory = false;
  int closed = 0;
  std::string reason;
};

// Makes a packet of this size, with the prefix, which counts the bytes behind itself, and equal bytes.
inline std::vector<std::uint8_t> packet(std::size_t bytes, std::uint8_t fill) {
  std::vector<std::uint8_t> made(bytes, fill);
  const auto counted = static_cast<std::uint32_t>(bytes - 4);
  std::memcpy(made.data(), &counted, 4);
  return made;
}

// A listener on a free port of the loopback, whose sessions echo. Everything runs on the test's thread: the server does
// nothing outside of run_until() and run_rounds().
class TransportTest : public testing::Test {
 protected:
  virtual TransportOptions options() {
    TransportOptions made;
    made.port = 0;
    return made;
  }
  virtual HttpService* service() { return nullptr; }
  void SetUp() override {
    auto created = Listener::create(
        loop_, options(), counters_,
        [this](std::shared_ptr<Connection> connection, std::int64_t) -> PacketSink* {
          if (refuse_) {
            connection->send(packet(32, 9));
            connection->close("refused");
            return nullptr;
          }
          echoes_.push_back(std::make_unique<Echo>(std::move(connection), joins_));
          return echoes_.back().get();
        },
        service());
    ASSERT_TRUE(created) << created.error();
    listener_ = std::move(*created);
  }
  // Runs the loop until `done`, or gives up after many rounds. A bound on time would fail on a busy machine. The first
  // thousand rounds do not sleep, the others sleep for 1 ms each, so time-outs of the server pass.
  template <class Done>
  bool run_until(Done done) {
    for (int i = 0; i < 20'000; ++i) {
      loop_.poll();
      if (done()) return true;
      ::poll(nullptr, 0, i < 1000 ? 0 : 1);
    }
    return false;
  }
  void run_rounds(int rounds) {
    for (int i = 0; i < rounds; ++i) {
      loop_.poll();
      ::poll(nullptr, 0, i % 8 == 0 ? 1 : 0);
    }
  }
  bool all_closed() {
    return run_until([&] { return counters_.connections_closed.value() == counters_.connections_accepted.value(); });
  }
  // Sends all of it, and reads until the server ends the connection.
  std::string answer_to(Peer& peer, std::string_view text) {
    std::size_t at = 0;
    EXPECT_TRUE(run_until([&] {
      if (at < text.size()) at += peer.send(text.substr(at));
      peer.receive();
      return peer.ended;
    })) << text.substr(0, 200);
    return peer.text();
  }

  TransportCounters counters_;
  IoLoop loop_;
  std::vector<std::unique_ptr<Echo>> echoes_;
  bool refuse_ = false, joins_ = true;
  std::unique_ptr<Listener> listener_;
};

}  // namespace hairnet::server
