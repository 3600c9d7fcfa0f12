#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio.hpp>
#include <chrono>
#include <functional>
#include <future>
#include <random>
#include <thread>

#include "client/link/link.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet::link {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using ::testing::HasSubstr;

bool is_sign_of_life(const wire::Message& message) {
  const auto* batch = std::get_if<wire::PoseBatch>(&message);
  return batch != nullptr && batch->poses.empty();
}

// Plays the server's side of one connection, on a thread of its own, as the test's script says. The destructor waits
// until the script has ended, so every script must come to an end.
class ScriptedServer {
 public:
  class Peer {
   public:
    explicit Peer(tcp::socket socket) : socket_(std::move(socket)) {}
    // Returns nothing when the client has closed the connection.
    std::optional<wire::Message> read() {
      std::uint32_t size = 0;
      boost::system::error_code ec;
      asio::read(socket_, asio::buffer(&size, 4), ec);
      if (ec) return std::nullopt;
      // The decoder needs packets to be aligned, so this is not a vector of bytes.
      std::vector<std::uint64_t> words((4 + size + 7) / 8);
      auto* packet = reinterpret_cast<std::uint8_t*>(words.data());
      std::memcpy(packet, &size, 4);
      asio::read(socket_, asio::buffer(packet + 4, size), ec);
      if (ec) return std::nullopt;
      wire::DecodedPacket decoded = wire::decode_packet({packet, 4 + std::size_t{size}});
      EXPECT_EQ(decoded.error, wire::DecodeError::none) << decoded.detail;
      return std::move(decoded.envelope.message);
    }
    // Reads the next message that is no sign of life; it must be a T.
    template <class T>
    T expect() {
      std::optional<wire::Message> message = read();
      while (message && !std::holds_alternative<T>(*message) && is_sign_of_life(*message)) message = read();
      EXPECT_TRUE(message && std::holds_alternative<T>(*message));
      return message && std::holds_alternative<T>(*message) ? std::get<T>(*message) : T{};
    }
    void send(wire::Message message) { send_bytes(wire::encode_packet({1, std::move(message)})); }
    void send_bytes(const std::vector<std::uint8_t>& bytes) {
      boost::system::error_code ignored;
      asio::write(socket_, asio::buffer(bytes), ignored);
    }
    // Answers the client's Hello and opens session 42, so that a script begins with a connection that works.
    void welcome() {
      expect<wire::Hello>();
      wire::Welcome welcome;
      welcome.session = 42;
      send(welcome);
    }

   private:
    tcp::socket socket_;
  };

  explicit ScriptedServer(std::function<void(Peer&)> script) : acceptor_(io_, {asio::ip::address_v4::loopback(), 0}) {
    thread_ = std::thread([this, script = std::move(script)] {
      boost::system::error_code ec;
      tcp::socket socket = acceptor_.accept(ec);
      if (ec) return;
      Peer peer(std::move(socket));
      script(peer);
    });
  }
  ~ScriptedServer() { thread_.join(); }
  [[nodiscard]] LinkOptions options(double timeout_s = 20) const {
    LinkOptions options;
    options.server.port = acceptor_.local_endpoint().port();
    // The server speaks plain TCP alone, so the Link must not try WebTransport first.
    options.transport = TransportChoice::address;
    options.core.connect_timeout_s = timeout_s;
    // The script ends with its connection, so a lost connection must be the end of the Link.
    options.core.reconnect = false;
    return options;
  }

 private:
  asio::io_context io_;
  tcp::acceptor acceptor_;
  std::thread thread_;
};
using Peer = ScriptedServer::Peer;

// Polls until the link has ended.
Disconnected wait_for_end(Link& link) {
  while (true) {
    for (const Event& event : link.poll()) {
      if (const auto* end = std::get_if<Disconnected>(&event)) return *end;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

// Makes a groom of one strand with this many points.
Groom groom_of(std::size_t points) {
  Groom groom;
  groom.name = "line";
  groom.group_names = {"all"};
  // The points are noise, which compression does not make smaller, so the size of the file is known.
  std::minstd_rand random;
  const auto noise = [&] { return 0.3f * static_cast<float>(random()) / static_cast<float>(std::minstd_rand::max()); };
  std::vector<Vec3f> strand(points);
  for (std::size_t i = 0; i < points; ++i) strand[i] = Vec3f(noise(), noise(), noise());
  groom.add_strand(strand, {});
  return groom;
}

TEST(Link, connects_by_hello_and_welcome_and_sends_goodbye) {
  std::promise<wire::GoodbyeReason> goodbye;
  ScriptedServer server([&](Peer& peer) {
    peer.welcome();
    goodbye.set_value(peer.expect<wire::Goodbye>().reason);
    EXPECT_FALSE(peer.read());
  });
  {
    Link link(server.options());
    const Result<wire::Welcome> welcome = link.connect();
    ASSERT_TRUE(welcome) << welcome.error();
    EXPECT_EQ(welcome->session, 42u);
    const std::vector<Event> events = link.poll();
    ASSERT_EQ(events.size(), 1u);
    EXPECT_TRUE(std::holds_alternative<Connected>(events[0]));
  }
  EXPECT_EQ(goodbye.get_future().get(), wire::GoodbyeReason::client_leaves);
}

TEST(Link, a_refused_connection_has_a_plain_reason) {
  LinkOptions options;
  {
    asio::io_context io;
    // The acceptor closes at the end of the block, so nobody listens at its port.
    options.server.port = tcp::acceptor(io, {asio::ip::address_v4::loopback(), 0}).local_endpoint().port();
  }
  Link link(options);
  const Result<wire::Welcome> welcome = link.connect();
  ASSERT_FALSE(welcome);
  EXPECT_THAT(welcome.error(), HasSubstr("cannot connect to 127.0.0.1:"));
  EXPECT_EQ(wait_for_end(link).detail, welcome.error());
}

TEST(Link, a_silent_server_runs_into_the_time_out) {
  std::promise<void> done;
  ScriptedServer server([&](Peer& peer) {
    peer.expect<wire::Hello>();
    done.get_future().wait();
  });
  // The time-out is 50 ms instead of the 20 s of the other tests, because this test waits for its end.
  Link link(server.options(0.05));
  const Result<wire::Welcome> welcome = link.connect();
  done.set_value();
  ASSERT_FALSE(welcome);
  EXPECT_THAT(welcome.error(), HasSubstr("within the time-out"));
}

TEST(Link, the_servers_goodbye_is_the_last_event_with_its_reason) {
  ScriptedServer server([](Peer& peer) {
    peer.welcome();
    peer.send(wire::Goodbye{wire::GoodbyeReason::server_draining, "going down"});
  });
  Link link(server.options());
  ASSERT_TRUE(link.connect());
  const Disconnected end = wait_for_end(link);
  EXPECT_EQ(end.reason, wire::GoodbyeReason::server_draining);
  EXPECT_THAT(end.detail, HasSubstr("going down"));
  EXPECT_TRUE(link.poll().empty());
}

TEST(Link, a_goodbye_instead_of_a_welcome_is_the_reason_of_the_refusal) {
  ScriptedServer server([](Peer& peer) {
    peer.expect<wire::Hello>();
    peer.send(wire::Goodbye{wire::GoodbyeReason::version_unsupported, "this server speaks version 9"});
  });
  Link link(server.options());
  const Result<wire::Welcome> welcome = link.connect();
  ASSERT_FALSE(welcome);
  EXPECT_THAT(welcome.error(), HasSubstr("version 9"));
}

TEST(Link, a_connection_that_just_closes_has_a_plain_reason) {
  ScriptedServer server([](Peer& peer) { peer.welcome(); });
  Link link(server.options());
  ASSERT_TRUE(link.connect());
  const Disconnected end = wait_for_end(link);
  EXPECT_EQ(end.reason, wire::GoodbyeReason::none);
  EXPECT_FALSE(end.detail.empty());
}

TEST(Link, bytes_that_are_no_packet_end_the_connection) {
  // A size of 4 GB is more than kPacketBytesMax. The garbage has a right size prefix, 64, and no packet after it.
  const std::vector<std::uint8_t> impossible_size{0xff, 0xff, 0xff, 0xff};
  std::vector<std::uint8_t> garbage{64, 0, 0, 0};
  garbage.resize(68, 0x40);
  for (const auto& bytes : {impossible_size, garbage}) {
    ScriptedServer server([&](Peer& peer) {
      peer.welcome();
      peer.send_bytes(bytes);
      while (peer.read()) {
      }
    });
    Link link(server.options());
    ASSERT_TRUE(link.connect());
    EXPECT_EQ(wait_for_end(link).reason, wire::GoodbyeReason::protocol_error);
  }
}

TEST(Link, a_message_that_only_clients_send_ends_the_connection) {
  ScriptedServer server([](Peer& peer) {
    peer.welcome();
    peer.send(wire::RemoveCharacter{1});
    while (peer.read()) {
    }
  });
  Link link(server.options());
  ASSERT_TRUE(link.connect());
  EXPECT_EQ(wait_for_end(link).reason, wire::GoodbyeReason::protocol_error);
}

RequestedState::Bytes shared(const std::vector<std::uint8_t>& bytes) {
  return std::make_shared<const std::vector<std::uint8_t>>(bytes);
}

TEST(Link, uploads_from_the_offset_that_the_server_asks_for) {
  const std::vector<std::uint8_t> bytes = wire::encode_groom(groom_of(20'000));
  std::vector<std::uint8_t> received;
  // The server has the first 1000 bytes already, as after an upload that broke off.
  const std::size_t offset = 1000;
  ScriptedServer server([&](Peer& peer) {
    peer.welcome();
    const auto offer = peer.expect<wire::GroomOffer>();
    EXPECT_EQ(offer.byte_count, bytes.size());
    peer.send(wire::GroomNeed{offer.hash, offset});
    while (offset + received.size() < bytes.size()) {
      const auto chunk = peer.expect<wire::GroomChunk>();
      ASSERT_EQ(chunk.offset, offset + received.size());
      ASSERT_FALSE(chunk.bytes.empty());
      received.insert(received.end(), chunk.bytes.begin(), chunk.bytes.end());
    }
    peer.send(wire::GroomStatus{offer.hash, wire::GroomState::ready});
    peer.send(wire::Goodbye{});
  });
  Link link(server.options());
  ASSERT_TRUE(link.connect());
  link.offer_groom(wire::hash_groom(bytes), shared(bytes));
  // A groom that is offered twice is uploaded once.
  link.offer_groom(wire::hash_groom(bytes), shared(bytes));
  wait_for_end(link);
  EXPECT_TRUE(std::equal(bytes.begin() + offset, bytes.end(), received.begin(), received.end()));
}

TEST(Link, poses_overtake_a_large_upload) {
  std::promise<void> upload_started, poses_pushed;
  std::size_t chunks_before = 0, chunks_after = 0;
  ScriptedServer server([&](Peer& peer) {
    peer.welcome();
    const auto offer = peer.expect<wire::GroomOffer>();
    peer.send(wire::GroomNeed{offer.hash, 0});
    std::uint64_t received = peer.expect<wire::GroomChunk>().bytes.size();
    upload_started.set_value();
    poses_pushed.get_future().wait();
    bool posed = false;
    while (received < offer.byte_count) {
      const std::optional<wire::Message> message = peer.read();
      ASSERT_TRUE(message);
      if (const auto* chunk = std::get_if<wire::GroomChunk>(&*message)) {
        received += chunk->bytes.size();
        ++(posed ? chunks_after : chunks_before);
      } else if (!is_sign_of_life(*message)) {
        posed = true;
      }
    }
    peer.send(wire::Goodbye{});
  });
  Link link(server.options());
  ASSERT_TRUE(link.connect());
  // The groom is far larger than the buffers of the sockets, so most of it still waits here when the pose is pushed.
  const std::vector<std::uint8_t> bytes = wire::encode_groom(groom_of(3'000'000));
  link.offer_groom(wire::hash_groom(bytes), shared(bytes));
  upload_started.get_future().wait();
  link.push_poses(std::vector<wire::PoseSample>(1));
  poses_pushed.set_value();
  wait_for_end(link);
  // The pose arrives before most chunks although it was pushed after them.
  EXPECT_GT(chunks_after, chunks_before);
}

TEST(Link, server_times_map_to_the_links_clock) {
  ScriptedServer server([](Peer& peer) {
    peer.welcome();
    while (peer.read()) {
    }
  });
  Link link(server.options());
  const std::int64_t before = link.now_ns();
  ASSERT_TRUE(link.connect());
  const std::int64_t after = link.now_ns();
  // The clock of the welcome is 1.
  const std::int64_t mapped = link.to_local_ns(1);
  EXPECT_GE(mapped, before);
  EXPECT_LE(mapped, after);
}

TEST(Link, a_link_with_nothing_to_send_still_shows_that_it_is_there) {
  ScriptedServer server([](Peer& peer) {
    peer.welcome();
    // An empty batch is the sign of life that a client sends when it has nothing else to send.
    EXPECT_TRUE(peer.expect<wire::PoseBatch>().poses.empty());
    peer.send(wire::Goodbye{});
  });
  Link link(server.options());
  ASSERT_TRUE(link.connect());
  wait_for_end(link);
}

TEST(Link, connecting_twice_is_refused) {
  ScriptedServer server([](Peer& peer) {
    peer.welcome();
    while (peer.read()) {
    }
  });
  Link link(server.options());
  ASSERT_TRUE(link.connect());
  EXPECT_FALSE(link.connect());
}

TEST(Link, close_ends_it_as_the_clients_own_wish) {
  ScriptedServer server([](Peer& peer) {
    peer.welcome();
    while (peer.read()) {
    }
  });
  Link link(server.options());
  ASSERT_TRUE(link.connect());
  link.close();
  EXPECT_EQ(wait_for_end(link).reason, wire::GoodbyeReason::client_leaves);
}

}  // namespace
}  // namespace hairnet::link
